"""The node hrp2_sim_bridge, its parameters and its messages."""
