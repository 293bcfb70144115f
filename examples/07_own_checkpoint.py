"""A checkpoint of torch training becomes a model file, and the engine aligns with it.

07_own_checkpoint.py runs/vnreg/vnreg.pt    (what `make train` writes; needs vnreg_train)
"""

import argparse
import subprocess
import sys
from pathlib import Path

import numpy as np

import vnreg

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("checkpoint", type=Path)
parser.add_argument("--out", type=Path, default=Path("mine.vnr"))
arguments = parser.parse_args()

# The averaged weights, written and checked: `vnreg-train export CHECKPOINT OUT --name mine`.
export = [sys.executable, "-m", "vnreg_train.cli", "export"]
subprocess.run([*export, arguments.checkpoint, arguments.out, "--name", "mine"], check=True)

model = vnreg.Model.load(arguments.out)
print(model)

data = Path(__file__).parent / "data"
source, target = np.loadtxt(data / "mug_1.xyz"), np.loadtxt(data / "mug_2.xyz")
result = vnreg.align(source, target, model=model)
print(result)  # confidence is nan until `vnreg-train calibrate` has measured it
print(result.T_target_source.round(3))
