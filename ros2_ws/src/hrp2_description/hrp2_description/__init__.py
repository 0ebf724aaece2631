"""A model of HRP-2 made from published figures: URDF, frames, soles, limits."""
