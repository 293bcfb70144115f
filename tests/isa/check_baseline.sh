#!/bin/sh
# check_baseline.sh LEVEL LIBRARY FILE...: no FILE has an instruction that came with AVX or later; nor has
# LIBRARY, the engine as it is compiled for LEVEL, if that is x86-64-v2. If it is a higher level, LIBRARY
# must have many: else the search would not find them. None of all these touches the registers of MMX,
# which are those of the caller's long double.
set -eu
level=$1 library=$2
shift 2
bmi='\s(andn|bextr|blsi|blsr|blsmsk|bzhi|mulx|pdep|pext|rorx|sarx|shlx|shrx|movbe)[lq]? '
count() {
  objdump -d --no-show-raw-insn "$1" | grep -Ec "%[yz]mm|\sv[a-z0-9]+ .*%xmm|$bmi" || true
}

for file in "$library" "$@"; do
  if objdump -d --no-show-raw-insn "$file" | grep -E '%mm[0-7]' >&2; then
    echo "$file: instructions of MMX" >&2
    exit 1
  fi
done
if [ "$level" = x86-64-v2 ]; then
  set -- "$library" "$@"
elif [ "$(count "$library")" -lt 1000 ]; then
  echo "$library: too few AVX instructions for $level" >&2
  exit 1
fi
for file; do
  found=$(count "$file")
  if [ "$found" -ne 0 ]; then
    echo "$file: $found instructions of AVX or later" >&2
    exit 1
  fi
done
echo "$# files without instructions of AVX or later"
