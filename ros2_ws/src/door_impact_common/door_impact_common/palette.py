"""Colours of figures, which colour-blind readers can tell apart.

They are those of M. Okabe and K. Ito, *Color Universal Design* (2008), except for the purple, which
is darker, so that thin lines and text show on white. Each figure uses line styles, markers or
labels beside the colours.
"""

BLUE = "#0072b2"
ORANGE = "#e69f00"
GREEN = "#009e73"
VERMILION = "#d55e00"
PURPLE = "#aa3377"
LINES = (BLUE, ORANGE, GREEN, VERMILION, PURPLE)
"""Colours of lines and markers, in the order in which a figure takes them."""
GREY = "#8a9099"
LIGHT_GREY = "#d9dce1"
"""Areas behind lines."""
