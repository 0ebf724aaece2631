"""Physical constants."""

GRAVITY = 9.80665  # standard acceleration of free fall, ISO 80000-3 [m/s^2]
