"""Colour-blind readers can tell the colours of lines apart."""

from itertools import combinations

import numpy as np
import pytest
from door_impact_common import palette

# What is left of linear sRGB in deuteranopia and protanopia (Machado, Oliveira and Fernandes, "A
# physiologically-based model for simulation of color vision deficiency", 2009).
SEEN = {
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
                     [-0.011820, 0.042940, 0.968881]],
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
                   [-0.003882, -0.048116, 1.051998]],
}
TO_XYZ = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
WHITE = [0.9505, 1.0, 1.089]
APART = 15.0  # difference in CIELAB (CIE 1976); side by side, some 2 can be seen


def lab(color: str, seen: list[list[float]]) -> np.ndarray:
    """CIELAB coordinates of a colour as it is seen."""
    part = np.array([int(color[at:at + 2], 16) for at in (1, 3, 5)]) / 255.0
    linear = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
    xyz = TO_XYZ @ np.clip(seen @ linear, 0.0, 1.0) / WHITE
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16.0 / 116.0)
    return np.array([116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])])


@pytest.mark.parametrize("seen", SEEN)
@pytest.mark.parametrize(("one", "other"), [*combinations(palette.LINES, 2)])
def test_two_colours_of_lines_differ(one: str, other: str, seen: str) -> None:
    matrix = np.array(SEEN[seen])
    assert np.linalg.norm(lab(one, matrix) - lab(other, matrix)) > APART
