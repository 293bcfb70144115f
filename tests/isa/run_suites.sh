#!/bin/bash
# run_suites.sh FOLDER [LEVEL...]: builds the library for every instruction set that this processor has, or
# for those named, and runs on each the C++ tests and those Python tests that call the engine.
set -euo pipefail
folder=$1
shift
root=$(realpath "$(dirname "$0")/../..")
python=${PYTHON:-$root/.venv/bin/python}
levels=${*:-$(/lib64/ld-linux-x86-64.so.2 --help | awk '/x86-64-v[234].*supported/ {print $1}' | sort)}
suites=(binding c_api cli examples export model_format parity)

for level in $levels; do
  build=$folder/$level
  echo "== $level"
  cmake --preset release -S "$root" -B "$build" -DVNREG_ISA="$level" -DVNREG_BUILD_BENCH=OFF \
    -DVNREG_BUILD_PYTHON=ON -DPython_EXECUTABLE="$python" > /dev/null
  cmake --build "$build"
  ctest --test-dir "$build" --output-on-failure
  VNREG_CLI=$build/vnreg VNREG_LIBRARY=$build/engine/libvnreg.so PYTHONPATH=$build/python \
    "$python" -m pytest -q "${suites[@]/#/$root/tests/python/}"
done
echo "== all tests passed on: $levels"
