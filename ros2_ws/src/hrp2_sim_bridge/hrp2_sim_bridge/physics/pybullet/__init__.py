"""The physics engine PyBullet; no other room of this package imports it, except the benches."""
