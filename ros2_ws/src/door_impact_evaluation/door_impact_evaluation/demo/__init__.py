"""The demonstration: every node, one door, one result."""
