"""The nodes impact_planner and impact_executor, and their messages."""
