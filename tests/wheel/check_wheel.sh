#!/bin/bash
# check_wheel.sh WHEEL FOLDER: what the wheel promises. It is small, needs numpy only, works from a clean
# virtual environment within 15 seconds, and carries three builds of the library that agree with each
# other. Its baseline has no instruction beyond x86-64-v2, and its name says which Pythons it serves.
set -euo pipefail
wheel=$(realpath "$1") folder=$2
here=$(realpath "$(dirname "$0")")
data=$(realpath "$here/../../examples/data")
fail() {
  echo "$1" >&2
  exit 1
}

rm -rf "$folder"
mkdir -p "$folder"
cd "$folder"
# One wheel serves every version from 3.12 on; older ones lack what that takes.
tag=$(python3 -c 'import sys; v = "cp3%d" % sys.version_info[1]
print("cp312-abi3" if sys.version_info >= (3, 12) else v + "-" + v)')
case $(basename "$wheel") in
  vnreg-*-"$tag"-linux_x86_64.whl) ;;
  *) fail "$wheel: not tagged $tag" ;;
esac
[ "$(stat -c %s "$wheel")" -lt 10000000 ] || fail "the wheel has 10 MB or more"
python3 -m zipfile -e "$wheel" content

baseline=content/vnreg/lib/libvnreg.so.0.1
for level in x86-64-v3 x86-64-v4; do
  [ -f "content/vnreg/lib/glibc-hwcaps/$level/libvnreg.so.0.1" ] || fail "no library for $level"
done
count() { # count PATTERN BINARY: instructions that match
  objdump -d --no-show-raw-insn "$2" | grep -Ec "$1" || true
}
avx='%[yz]mm|\sv[a-z0-9]+ .*%xmm'
for binary in "$baseline" content/vnreg/_vnreg*.so; do
  [ "$(count "$avx" "$binary")" -eq 0 ] || fail "$binary has AVX instructions"
done
levels_of=content/vnreg/lib/glibc-hwcaps
[ "$(count %ymm "$levels_of/x86-64-v3/libvnreg.so.0.1")" -gt 1000 ] || fail "x86-64-v3 has no AVX2"
[ "$(count %zmm "$levels_of/x86-64-v4/libvnreg.so.0.1")" -gt 1000 ] || fail "x86-64-v4 has no AVX-512"

# The venv and numpy are what any Python user has; the clock runs for the wheel.
python3 -m venv clean
clean/bin/pip install -q numpy
started=$(date +%s%N)
clean/bin/pip install -q --no-index "$wheel"
cat > five_lines.py <<PYTHON
import numpy as np, vnreg
source, target = np.loadtxt("$data/mug_1.xyz"), np.loadtxt("$data/mug_2.xyz")
result = vnreg.align(source, target)
print(vnreg.instruction_set(), result)
assert result.has_pose
PYTHON
clean/bin/python five_lines.py
ms=$((($(date +%s%N) - started) / 1000000))
echo "$ms ms from the wheel to the pose"
[ "$ms" -lt 15000 ] || fail "that is more than 15 seconds"

cat > level.py <<PYTHON
import sys
import numpy as np, vnreg
assert vnreg.instruction_set() == sys.argv[1], vnreg.instruction_set()
source, target = np.loadtxt("$data/mug_1.xyz"), np.loadtxt("$data/mug_2.xyz")
poses = [vnreg.align(source, target, mode=mode).T_target_source for mode in ("coarse", "verified")]
np.save(sys.argv[1] + ".npy", poses)
PYTHON
# The loader is told of a lesser processor; what the processor itself lacks is left out.
levels=$(/lib64/ld-linux-x86-64.so.2 --help | awk '/x86-64-v[234].*supported/ {print $1}')
for level in $levels; do
  case $level in
    x86-64-v4) hide= ;;
    x86-64-v3) hide=-AVX512F ;;
    x86-64-v2) hide=-AVX512F,-AVX2 ;;
  esac
  GLIBC_TUNABLES=glibc.cpu.hwcaps=$hide clean/bin/python level.py "$level"
done
clean/bin/python - <<PYTHON
import glob
import numpy as np
poses = {path: np.load(path) for path in sorted(glob.glob("x86-64-v*.npy"))}
first = next(iter(poses.values()))
for path, pose in poses.items():
    coarse, verified = np.abs(pose - first).reshape(2, -1).max(axis=1)
    print(path, "differs from the first by", coarse, "(coarse)", verified, "(verified)")
    assert coarse < 1e-4 and verified < 1e-2
PYTHON
