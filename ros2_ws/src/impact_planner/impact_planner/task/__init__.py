"""What a plan is made from: the request, the known door, settings and experience."""
