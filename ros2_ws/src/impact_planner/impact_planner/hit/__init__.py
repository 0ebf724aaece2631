"""The hit itself: momentum, effective mass, stance and posture, eqs. (2) to (5)."""
