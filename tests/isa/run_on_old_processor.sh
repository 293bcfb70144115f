#!/bin/sh
# run_on_old_processor.sh LEVEL PROGRAM CLOUDS: on a processor of 2008, which has x86-64-v2 and no AVX, the
# program aligns, or, compiled for a higher LEVEL, says why it cannot.
set -eu
level=$1 program=$2 clouds=$3
code=0
qemu-x86_64 -cpu Nehalem "$program" --version | grep -F "($level)"
said=$(qemu-x86_64 -cpu Nehalem "$program" align "$clouds/mug_1.xyz" "$clouds/mug_2.xyz" --mode coarse 2>&1) ||
  code=$?
echo "$said" | tail -n 3
if [ "$level" = x86-64-v2 ]; then
  echo "$said" | grep -q '^T_target_source'
else
  [ "$code" -eq 1 ]
  [ "$said" = "vnreg: processor: expected $level, found less" ]
fi
