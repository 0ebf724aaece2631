"""Recovery steps: where to put the next foot after a push."""
