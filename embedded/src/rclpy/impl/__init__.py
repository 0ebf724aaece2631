"""Parts of rclpy that programs import for type annotations."""
