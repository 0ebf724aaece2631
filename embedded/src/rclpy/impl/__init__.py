"""Parts of rclpy that programs import from here, for the types of their variables."""
