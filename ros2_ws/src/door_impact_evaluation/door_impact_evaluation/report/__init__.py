"""Tables, figures and the animation of a run."""
