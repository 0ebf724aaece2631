"""Identification of a closer's parameters from free swings, eq. (6), and how sure it is."""
