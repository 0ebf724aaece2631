"""Runs a walk: decides from measurements what to send to the driver, and when."""
