"""Door-closer linkage, door dynamics and the identification of the closer's parameters."""
