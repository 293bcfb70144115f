#!/usr/bin/env bash
# Lines of the model format and of the cloud readers that the committed corpora cover, by llvm-cov.
# What takes a path instead of bytes is left out: read_file.cpp and the writer, which have tests.
# usage: fuzz/coverage.sh BUILD [LEAST]; fails below LEAST percent (default 90).
set -euo pipefail
least=${2:-90}
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$1"
readers=(ply pcd obj off text npy detect model)
objects=()
for target in "${readers[@]}"; do
  LLVM_PROFILE_FILE=$target.profraw ./fuzz_$target -runs=0 \
    "$root/fuzz/corpus/$target" > /dev/null 2>&1
  objects+=(-object "fuzz_$target")
done
llvm-profdata-14 merge -sparse "${readers[@]/%/.profraw}" -o all.profdata
report() {
  llvm-cov-14 report "${objects[@]:1}" -instr-profile=all.profdata "$@" 2> /dev/null |
    awk '/\.(cpp|hpp) / {print $1, $8, $9, $10} /^TOTAL/ {print "total", $8, $9, $10}' | column -t
}
for part in model_format cli/cloud_file; do
  echo "$part: lines, missed, covered"
  mapfile -t files < <(find "$root/$part" -name '*.cpp' ! -name ply_writer.cpp ! -name read_file.cpp)
  report "${files[@]}" | tee report.txt
  covered=$(awk '/^total/ {print int($4)}' report.txt)
  [ "$covered" -ge "$least" ] || { echo "below $least percent" >&2; exit 1; }
done
