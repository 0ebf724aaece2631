"""Running a plan: detection of the contact, switches between phases, refusals before the start."""
