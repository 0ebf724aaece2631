"""Identification of a closer's parameters and their uncertainty from free swings, eq. (6)."""
