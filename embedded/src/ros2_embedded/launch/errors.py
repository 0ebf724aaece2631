"""Errors of launch files."""


class LaunchError(Exception):
    """A launch file, or an argument for it, that makes no sense."""
