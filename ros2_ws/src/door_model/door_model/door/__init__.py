"""The door and its closer: linkage, parameters, configuration, eqs. (1) and (7) to (13)."""
