"""ZMP, CoM and support polygon from the foot wrenches and joint angles that a driver publishes."""
