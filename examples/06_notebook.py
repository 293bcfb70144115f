"""From Python, cell by cell: read, align, look. Writes 06_notebook.png into the current folder.

Needs matplotlib. The marks `# %%` make cells of it in an editor that knows them.
"""

# %% Two scans, from different sides
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import vnreg

data = Path(__file__).parent / "data"
source = np.loadtxt(data / "mug_1.xyz")
target = np.loadtxt(data / "mug_2.xyz")

# %% One call
result = vnreg.align(source, target)
print(result)
print(result.T_target_source.round(3))

# %% How sure, and how exact: standard deviations of the rotation (degrees) and the shift (mm)
deviation = np.sqrt(np.diag(result.covariance))
print(f"confidence {result.confidence:.2f}")
print("rotation +-", np.degrees(deviation[:3]).round(2), "degrees")
print("shift +-", (1000 * deviation[3:]).round(2), "mm")
for other in result.alternatives:
    print(f"another pose fits with score {other.score:.2f} against {result.score:.2f}")

# %% Before and after
R, t = result.T_target_source[:3, :3], result.T_target_source[:3, 3]
moved = source @ R.T + t
figure = plt.figure(figsize=(8, 4))
for column, (title, cloud) in enumerate([("before", source), ("after", moved)]):
    axes = figure.add_subplot(1, 2, column + 1, projection="3d")
    axes.scatter(*target.T, s=2, label="target")
    axes.scatter(*cloud.T, s=2, label="source")
    axes.set_title(title)
    axes.set_aspect("equal")
    axes.legend()
figure.savefig("06_notebook.png", dpi=120)
