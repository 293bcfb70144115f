#!/usr/bin/env bash
# Runs fuzz targets, each for so many seconds, from the committed corpus; JOBS=2 of them at a time.
# usage: fuzz/run.sh BUILD SECONDS [TARGET...]
# What is new goes to BUILD/corpus/TARGET, an input that breaks a promise to BUILD/findings, where the
# run ends with an error. For each target: executions, and the edges of the code that were covered.
set -euo pipefail
build=$1 seconds=$2
shift 2
fuzz=$(cd "$(dirname "$0")" && pwd)
targets=("$@")
[ ${#targets[@]} -gt 0 ] ||
  targets=(ply pcd obj off text npy detect pairs results model architecture kernels builds align)
mkdir -p "$build/findings"
export OMP_NUM_THREADS=1
# In memory, where the system has such a folder: every input of `results` makes files.
[ ! -d /dev/shm ] || export TMPDIR=/dev/shm
# The levels that this processor has, of the preset fuzz-builds beside the build.
libraries=$build/../fuzz-builds/engine/libvnreg.so
for level in $(/lib64/ld-linux-x86-64.so.2 --help | sed -n 's/^ *\(x86-64-v[34]\) (supported.*/\1/p'); do
  libraries=$libraries:$build/../fuzz-builds/hwcaps/$level/engine/libvnreg.so
done
export VNREG_FUZZ_LIBRARIES=$libraries

# Runs one target and says how it went, all at once, so that the lines of several stay apart.
run() {
  local target=$1 result=ok executions edges said
  local corpus=$fuzz/corpus/${target/architecture/model} dictionary=$fuzz/${target/architecture/model}.dict
  local log=$build/findings/$target.log
  local options=(-max_total_time="$seconds" -timeout=20 -rss_limit_mb=2048 -malloc_limit_mb=512
                 -print_final_stats=1 -artifact_prefix="$build/findings/$target-")
  case $target in
    model | architecture) options+=(-max_len=16384) ;;
    kernels | builds | align | results) options+=(-max_len=1024) ;;
    *) options+=(-max_len=600) ;;
  esac
  [ ! -f "$dictionary" ] || options+=(-dict="$dictionary")
  mkdir -p "$build/corpus/$target"
  "$build/fuzz_$target" "$build/corpus/$target" "$corpus" "${options[@]}" > "$log" 2>&1 || result=FAILED
  executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  edges=$(grep -o 'cov: [0-9]*' "$log" | tail -n 1 | cut -d' ' -f2 || true)
  printf -v said '%-12s %-6s %10s executions %6s edges' "$target" $result "$executions" "${edges:--}"
  [ $result = ok ] ||
    said+=$'\n'$(grep -m 3 -E 'runtime error|ERROR|broken promise|SUMMARY' "$log" || tail -n 20 "$log")
  echo "$said"
  [ $result = ok ]
}

running=0 status=0
for target in "${targets[@]}"; do
  if [ $running -ge "${JOBS:-1}" ]; then
    wait -n || status=1
    running=$((running - 1))
  fi
  run "$target" &
  running=$((running + 1))
done
while [ $running -gt 0 ]; do
  wait -n || status=1
  running=$((running - 1))
done
exit $status
