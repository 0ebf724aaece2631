"""The base of the drop-in `rclpy`: interface definitions, the DDS mapping, the commands."""
