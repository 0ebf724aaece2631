"""The commands `plan`, with its text and its figure, and `find_posture`."""
