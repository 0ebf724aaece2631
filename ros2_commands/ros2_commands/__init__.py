"""The `ros2` command and launch files in YAML, for an rclpy that comes without ROS 2's own."""
