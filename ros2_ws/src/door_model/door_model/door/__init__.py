"""The door and its closer: linkage, parameters and configuration, eqs. (1) and (7) to (13)."""
