#!/bin/sh
# build_with_cmake.sh PROJECT FOLDER [cmake options]: configures and builds a consumer afresh, runs its
# programs, and fails where a flag of vnreg's own build reaches the consumer's sources.
set -eu
project=$1 folder=$2
shift 2
rm -rf "$folder"
cmake -S "$project" -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=Release "$@"
cmake --build "$folder" --target consumer_c consumer_cpp
if grep '"command".*main\.c' "$folder/compile_commands.json" |
  grep -E -e '-march|-mavx|-fopenmp|-ffp-contract|-fno-math-errno|eigen|EIGEN|VNREG_'; then
  echo "a flag of vnreg's own build has leaked" >&2
  exit 1
fi
"$folder/consumer_c"
"$folder/consumer_cpp"
