"""Benchmarks; each measures this project and, in the same run, a peer."""
