"""The node closer_identifier, and the conversion of sample batches to messages and back."""
