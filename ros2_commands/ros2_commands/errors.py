"""The error of commands."""


class CommandError(RuntimeError):
    """Tells the user what is wrong; the command's exit status is 1."""
