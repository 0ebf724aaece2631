"""The nodes door_encoder, counter_board and play."""
