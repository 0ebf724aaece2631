"""The log of a run: every command, every state, and how to run it again."""
