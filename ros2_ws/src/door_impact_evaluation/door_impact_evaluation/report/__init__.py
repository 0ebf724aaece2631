"""Table, figures, animation and replay of a run; the replay of any recording."""
