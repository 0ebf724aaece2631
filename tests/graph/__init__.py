"""Tests of the whole graph: one set of nodes serves them all."""
