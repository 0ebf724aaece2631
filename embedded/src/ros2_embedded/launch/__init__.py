"""`ros2 launch`: reads launch files in YAML, starts their processes and leaves none behind."""
