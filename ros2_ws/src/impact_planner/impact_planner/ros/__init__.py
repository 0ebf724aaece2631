"""The node impact_planner, and its messages."""
