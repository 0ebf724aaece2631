"""The log of a run: all orders and true states; `replay` repeats a run from it."""
