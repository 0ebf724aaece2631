"""The physics engine MuJoCo; no other room of this package imports it, except the benches."""
