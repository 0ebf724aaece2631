"""`ros2 launch`: reads launch files in YAML, starts their nodes and ends all of them."""
