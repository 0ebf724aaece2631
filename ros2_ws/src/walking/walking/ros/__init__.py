"""The node walker: walks as the action /walk."""
