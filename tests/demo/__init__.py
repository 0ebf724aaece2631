"""Tests of the demonstration: one run serves them all."""
