"""The figures that docs/paper/notes.md names in braces, as it prints them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vnreg_train.evaluate.bars import LIMIT
from vnreg_train.paper.extrapolate import (
    SPEED,
    budget_table,
    points_per_doubling,
)
from vnreg_train.paper.published import BARS, EPOCHS, SHAPES
from vnreg_train.paper.training_speed import PAPER

Figures = Mapping[str, Any]


def note_values(figures: Figures) -> dict[str, str]:
    """Of every part."""
    return {
        **_recall_values(figures),
        **_training_values(figures),
        **_ablation_values(figures["ablation"]),
        **_speed_values(figures),
    }


def _recall_values(figures: Figures) -> dict[str, str]:
    """SETTING_coarse, _fine, _longer: recall at 180 degrees on the tested pairs, in %.

    SETTING_near, _median: of the coarse poses of the validation pairs, the share within 30 degrees
    and the median angle. opposite, opposite_hits: pairs cropped towards opposite sides.
    """
    values = {}
    for setting in BARS:
        row = figures["recall"]["rows"][f"P0/{setting}/180"]
        longer = figures["longer"]["rows"][f"P0/{setting}/180"]["paper"]
        for name, of in (("coarse", row["coarse"]), ("fine", row["paper"]), ("longer", longer)):
            values[f"{setting}_{name}"] = f"{100 * of['plain'][LIMIT]['recall']:.1f}"
    for setting, of in figures["iterations"]["coarse"].items():
        values[f"{setting}_near"] = f"{100 * of['within_30_deg']:.0f}"
        values[f"{setting}_median"] = f"{of['median_deg']:.1f}"
    opposite = figures["recall"]["rows"]["P0/partial/180"]["paper"]["halves"]["opposite"]
    return values | {"opposite_hits": str(opposite["hits"]), "opposite": str(opposite["pairs"])}


def _training_values(figures: Figures) -> dict[str, str]:
    pairs = figures["curve"]["pairs"]
    rate = figures["training_speed"]["recipes"][PAPER.title]["pairs_per_second"]
    return {
        "coarse_pairs": f"{pairs['coarse']:,}",
        "fine_pairs": f"{pairs['fine']:,}",
        "refined_pairs": f"{pairs['refined']:,}",
        "paper_pairs": f"{EPOCHS * SHAPES / 1e6:.1f} million",
        "doubling": f"{points_per_doubling(figures['curve']['curves']['coarse']['recall']):.0f}",
        "budgets": budget_table(figures),
        "paper_width_hours": f"{sum(pairs.values()) / rate / 3600:.0f}",
    }


def _ablation_values(ablation: Figures) -> dict[str, str]:
    """line_NAME: recall of coarse + fine, in %."""
    return {
        f"line_{name}": f"{100 * of['recall']['fine']['recall']:.1f}"
        for name, of in ablation["variants"].items()
    }


def _speed_values(figures: Figures) -> dict[str, str]:
    speed = figures["speed"]["networks"]["paper"]
    ms = speed["ms"]
    recipes = figures["training_speed"]["recipes"]
    bfloat16 = recipes[SPEED]["gflop_per_second"]
    float32 = recipes[SPEED.removesuffix(", bf16")]["gflop_per_second"]
    kernel = figures["kernel_rate"]
    return {
        "ratio": f"{speed['ratio']:.2f}",
        "encoder_ms": f"{ms['two'] - ms['shared']:.0f}",
        "rest_ms": f"{2 * ms['shared'] - ms['two']:.0f}",
        "kernel_rate": f"{kernel:.0f}",
        "bfloat16_rate": f"{bfloat16:.0f}",
        "float32_rate": f"{float32:.0f}",
        "at_most": f"{kernel / bfloat16:.1f}",
        "at_70": f"{0.7 * kernel / bfloat16:.1f}",
        "at_most_float32": f"{kernel / float32:.1f}",
    }
