"""The error with which a command ends."""


class CommandError(RuntimeError):
    """Tells the user what is wrong; the command's exit status is 1."""
