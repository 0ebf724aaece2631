"""Where the feet go: footsteps, their limits, and footsteps to a goal pose."""
