"""One run of the whole system: executing it without nodes, its log and what is measured in it."""
