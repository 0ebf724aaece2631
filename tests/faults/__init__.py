"""Faults of messages, executor and driver in a hit, judged by the simulation's truth."""
