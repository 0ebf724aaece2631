"""Kinematics and dynamics of a humanoid, without ROS: what planner, driver and walking share."""
