"""What the paper reports (Lin et al., ICRA 2023, tables I to V; ModelNet40, a Titan RTX)."""

from __future__ import annotations

# Recall in % at 45, 90, 135 and 180 degrees, by setting.
Recalls = dict[str, tuple[float, float, float, float]]

BASELINES: dict[str, Recalls] = {
    "IDAM": {
        "clean": (99.3, 98.2, 96.9, 97.0),
        "noisy": (91.6, 45.1, 21.8, 15.6),
        "independent": (75.2, 20.2, 6.9, 2.9),
        "partial": (98.8, 69.4, 37.6, 27.1),
    },
    "RPMNet": {
        "clean": (99.7, 91.6, 67.8, 49.3),
        "noisy": (91.4, 62.0, 33.8, 25.5),
        "independent": (90.5, 58.4, 22.1, 11.2),
        "partial": (90.2, 54.4, 23.9, 13.5),
    },
    "Predator": {
        "clean": (99.8, 91.2, 53.9, 33.6),
        "noisy": (98.0, 59.6, 21.8, 10.7),
        "independent": (99.5, 85.9, 46.4, 25.2),
        "partial": (96.4, 53.2, 16.7, 8.8),
    },
    "DeepGMR": {
        "clean": (100.0, 100.0, 100.0, 100.0),
        "noisy": (83.1, 84.7, 82.9, 83.9),
        "independent": (20.9, 19.6, 19.0, 19.3),
        "partial": (46.7, 48.2, 48.2, 46.6),
    },
    "EquivReg": {
        "clean": (100.0, 100.0, 100.0, 100.0),
        "noisy": (89.0, 89.0, 88.9, 89.3),
        "independent": (43.8, 44.0, 44.4, 42.6),
        "partial": (51.9, 51.5, 49.2, 48.4),
    },
}
BARS = {"clean": 100.0, "noisy": 95.0, "independent": 80.0, "partial": 60.0}  # at 180 degrees
SPEED_BAR = 1.8  # how many times faster the shared encoder is
EPOCHS, SHAPES, BATCH = 1000, 9843, 32  # of the authors' training
