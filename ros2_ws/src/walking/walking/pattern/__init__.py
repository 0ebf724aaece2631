"""From footsteps to a whole-body motion that keeps the ZMP in the soles."""
