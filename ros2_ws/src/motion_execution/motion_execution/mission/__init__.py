"""What a robot does before a door, and who may move it: the policy, without ROS."""
