"""Colours of what is drawn beside robot and door, in the live view and in the replay.

They are those of Okabe and Ito, *Color Universal Design* (2008), which colour-blind readers can
tell apart. Each is red, green, blue from 0 to 255.
"""

from __future__ import annotations

Rgb = tuple[int, int, int]

ZMP: Rgb = (213, 94, 0)  # vermilion
COM: Rgb = (0, 114, 178)  # blue
CAPTURE_POINT: Rgb = (0, 158, 115)  # bluish green
SUPPORT: Rgb = (86, 180, 233)  # sky blue: the support polygon
FORCE: Rgb = (230, 159, 0)  # orange: forces on feet and hands
DOOR: Rgb = (204, 121, 167)  # reddish purple: the door's angle in plots


def css(color: Rgb) -> str:
    """Return a colour as in CSS, such as ``#d55e00``."""
    return "#{:02x}{:02x}{:02x}".format(*color)
