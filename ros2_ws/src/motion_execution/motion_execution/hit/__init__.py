"""Execution of a plan: checks before the start, detection of the contact, change of phases."""
