"""Command ``plan``, its text and its figures."""
