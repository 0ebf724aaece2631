"""The command `plan`, with its text and its figure."""
