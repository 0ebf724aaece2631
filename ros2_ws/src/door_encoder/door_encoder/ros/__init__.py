"""The nodes: door_encoder decodes counts, counter_board polls a board, play sends a recording."""
