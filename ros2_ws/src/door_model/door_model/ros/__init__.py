"""The node closer_identifier."""
