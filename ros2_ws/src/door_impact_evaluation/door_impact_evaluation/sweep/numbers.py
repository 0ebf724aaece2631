"""Statistics of a sweep's figures. A figure that is not known is None or NaN, and never hidden."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from door_impact_common.arrays import Array

Figure = float | None
"""A figure of a run; None or NaN if it is not known."""


def is_known(value: Figure) -> bool:
    """Returns whether a figure is a finite number."""
    return value is not None and math.isfinite(value)


def known(values: Iterable[Figure]) -> Array:
    """Returns the figures that are known, (n,)."""
    return np.array([value for value in values if value is not None and math.isfinite(value)],
                    dtype=float)


def goodness(value: Figure) -> float:
    """Returns a figure, of which a larger one is better; one that is not known is the worst."""
    return float(value) if value is not None and math.isfinite(value) else -math.inf


def smallness(value: Figure) -> float:
    """Returns the goodness of a figure that is better the smaller its size is."""
    return goodness(None if value is None else -abs(value))


def plain(value: Any) -> Any:
    """Returns a value as JSON can have it: numbers that are not finite become None.

    Args:
        value: Lists, tuples and dicts of numbers, texts, truth values and None.
    """
    if isinstance(value, dict):
        return {name: plain(each) for name, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def statistics(errors: Iterable[Figure]) -> dict[str, Figure]:
    """Computes the mean and the standard deviation of errors, p95 and maximum of their sizes.

    Args:
        errors: Errors; what is not known is left out.

    Returns:
        The statistics in the errors' unit; each is None without errors.
    """
    found = known(errors)
    if not len(found):
        return dict.fromkeys(("mean", "sd", "p95", "max"))
    size = np.abs(found)
    return {"mean": float(found.mean()), "sd": float(found.std(ddof=1)) if len(found) > 1 else 0.0,
            "p95": float(np.percentile(size, 95.0)), "max": float(size.max())}


def smallest(values: Iterable[Figure]) -> dict[str, Figure]:
    """Computes the 5th percentile and the minimum of margins; None where none is known."""
    found = known(values)
    if not len(found):
        return {"p5": None, "min": None}
    return {"p5": float(np.percentile(found, 5.0)), "min": float(found.min())}


def largest(values: Iterable[Figure]) -> dict[str, Figure]:
    """Computes the 95th percentile and the maximum of sizes; None where none is known."""
    found = np.abs(known(values))
    if not len(found):
        return {"p95": None, "max": None}
    return {"p95": float(np.percentile(found, 95.0)), "max": float(found.max())}


def shown(value: Figure, form: str = ".0f") -> str:
    """Formats a figure for a table; what is not known is a dash."""
    return "-" if value is None or not math.isfinite(value) else format(value, form)
