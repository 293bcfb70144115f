#!/usr/bin/env bash
# Lines of the engine, the kernels and the model format that the C++ tests cover, by llvm-cov.
# Left out: the suite `allocation`, because clang's OpenMP allocates where GCC's does not, and
# `looks`, whose milliseconds are those of an optimised build.
# usage: tests/coverage.sh BUILD [LEAST]; fails below LEAST percent (default 85).
set -euo pipefail
least=${2:-85}
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$1"
LLVM_PROFILE_FILE="$PWD/profiles/%p.profraw" ctest --output-on-failure \
  -R '^(kernels|model_format|engine)$'
llvm-profdata-14 merge -sparse profiles/*.profraw -o tests.profdata
rm -r profiles
objects=()
while read -r test; do objects+=(-object "$test"); done < <(find . -maxdepth 1 -type f -name 'test_*' -perm -u+x)
for part in engine kernels model_format; do
  echo "$part: lines, missed, covered"
  mapfile -t files < <(find "$root/$part" -name '*.cpp' ! -path '*/reference/*')
  llvm-cov-14 report "${objects[@]:1}" -instr-profile=tests.profdata "${files[@]}" 2> /dev/null |
    awk '/\.(cpp|hpp) / {print $1, $8, $9, $10} /^TOTAL/ {print "total", $8, $9, $10}' | column -t | tee report.txt
  covered=$(awk '/^total/ {print int($4)}' report.txt)
  [ "$covered" -ge "$least" ] || { echo "below $least percent" >&2; exit 1; }
done
