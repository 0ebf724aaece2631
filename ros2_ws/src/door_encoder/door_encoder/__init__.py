"""Door encoder: counts to a checked, unwrapped, zeroed angle."""
