"""What a plan is made from: the request, the door that is known, settings and experience."""
