"""ZMP, CoM and support polygon from foot wrenches and joint angles, as a driver publishes them."""
