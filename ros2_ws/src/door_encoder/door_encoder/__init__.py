"""Door encoder: raw counts of a counter board become a checked, unwrapped and zeroed angle."""
