"""Motions before and after the hit, phase by phase, checked against every limit."""
