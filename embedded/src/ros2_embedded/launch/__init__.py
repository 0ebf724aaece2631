"""`ros2 launch`: reads launch files in YAML, starts their processes and ends all of them."""
