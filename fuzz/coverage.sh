#!/usr/bin/env bash
# Lines that the committed corpora cover, by llvm-cov: of the model format and of the cloud readers by
# all their targets together, then of each target's own code by its corpus alone. What takes a path
# instead of bytes is left out: read_file.cpp and the writer, which have tests.
# usage: fuzz/coverage.sh BUILD [LEAST]; fails if the first two are below LEAST percent (default 90).
set -euo pipefail
least=${2:-90}
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$1"

# The code that a target is there for.
own_files() {
  case $1 in
    ply | obj | off | npy) echo "$root/cli/cloud_file/$1_reader.cpp" ;;
    pcd) echo "$root"/cli/cloud_file/{pcd_reader,lzf}.cpp ;;
    text) echo "$root"/cli/cloud_file/text_{reader,scan}.cpp ;;
    detect) echo "$root/cli/cloud_file/cloud_file.cpp" ;;
    pairs) echo "$root"/cli/batch/{pair_table,csv}.cpp ;;
    results) echo "$root"/cli/batch/{result_row,results_file,row_journal,run_record}.cpp ;;
    model) find "$root/model_format" -name '*.cpp' ! -name read_file.cpp ;;
    architecture) echo "$root"/engine/{architecture,descriptor_model,judge_model,model_data,tensor_set}.cpp ;;
    kernels) find "$root/kernels" -maxdepth 1 -name '*.cpp' ;;
    align) find "$root/engine" -name '*.cpp' ;;
  esac
}

# Prints lines, missed and covered of the files, and of all together.
report() {
  local profile=$1 files=()
  shift
  mapfile -t files
  llvm-cov-14 report "$@" -instr-profile="$profile" "${files[@]}" 2> /dev/null |
    awk '/\.(cpp|hpp) / {print $1, $8, $9, $10} /^TOTAL/ {print "total", $8, $9, $10}' | column -t
}

readers=(ply pcd obj off text npy detect model)
targets=("${readers[@]}" pairs results architecture kernels align)
for target in "${targets[@]}"; do
  LLVM_PROFILE_FILE=$target.profraw ./fuzz_"$target" -runs=0 \
    "$root/fuzz/corpus/${target/architecture/model}" > /dev/null 2>&1
  llvm-profdata-14 merge -sparse "$target.profraw" -o "$target.profdata"
done

llvm-profdata-14 merge -sparse "${readers[@]/%/.profraw}" -o readers.profdata
for part in model_format cli/cloud_file; do
  echo "$part: lines, missed, covered"
  find "$root/$part" -name '*.cpp' ! -name ply_writer.cpp ! -name read_file.cpp |
    report readers.profdata fuzz_ply "${readers[@]/#/-object=fuzz_}" | tee report.txt
  covered=$(awk '/^total/ {print int($4)}' report.txt)
  [ "$covered" -ge "$least" ] || { echo "below $least percent" >&2; exit 1; }
done

echo "each target's own code: lines, missed, covered"
for target in "${targets[@]}"; do
  own_files "$target" | tr ' ' '\n' | report "$target.profdata" "fuzz_$target" |
    awk -v target="$target" '/^total/ {print target, $2, $3, $4}'
done | column -t
