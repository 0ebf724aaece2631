"""`ros2 launch`: read launch files in YAML, start their nodes and end all of them."""
