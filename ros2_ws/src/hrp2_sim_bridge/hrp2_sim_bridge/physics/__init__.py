"""Robot and door in the physics engine."""
