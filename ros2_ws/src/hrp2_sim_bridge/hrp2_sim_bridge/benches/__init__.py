"""Small experiments that show what the simulated contact and robot do."""
