"""One HTML page that shows a recorded motion: robot and door, plots, and a slider for the time."""
