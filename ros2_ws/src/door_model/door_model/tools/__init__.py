"""The command `identify`, with its table and the files that it writes."""
