"""Names above the spans of a figure's x axis, such as the phases of a motion, without overlap."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

_GAP = 4.0  # smallest distance between two names of a row [pt]
_LINE = 1.45  # distance between two rows, as a multiple of the letters' size


def label_spans(axes: Any, spans: Sequence[tuple[str, float, float]], size: float = 8.0) -> float:
    """Write the name of each span above it, and move a name up where it would meet another one.

    The axes must have their final limits and the figure its final size and layout along x.

    Args:
        axes: Matplotlib's axes.
        spans: Name, start and end of each span, in the unit of the x axis. A span without a name,
            or whose start or end is no finite number, is left out.
        size: Size of the letters [pt].

    Returns:
        Height of the names above the axes, for the pad of a title [pt].
    """
    figure = axes.figure.figure  # a part of a figure names the whole
    figure.draw_without_rendering()  # the layout decides how long a second is
    point = figure.dpi / 72.0
    rows: list[float] = []  # right end of the last name in each row [pixel]
    shown = [span for span in spans if span[0] and all(map(math.isfinite, span[1:]))]
    for name, start, end in sorted(shown, key=lambda span: span[1] + span[2]):
        middle = 0.5 * (start + end)
        label = axes.annotate(
            name, (middle, 1.0), xycoords=axes.get_xaxis_transform(), xytext=(0.0, 3.0),
            textcoords="offset points", ha="center", va="bottom", fontsize=size)
        box = label.get_window_extent()
        free = [row for row, right in enumerate(rows) if right + _GAP * point <= box.x0]
        row = free[0] if free else len(rows)
        rows[row:row + 1] = [float(box.x1)]
        label.xyann = (0.0, 3.0 + row * _LINE * size)
    return 6.0 + len(rows) * _LINE * size
