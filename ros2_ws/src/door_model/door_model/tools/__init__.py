"""Command lines of this package, and what they print and draw."""
