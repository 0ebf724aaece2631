"""Errors of the demonstration."""


class DemoError(Exception):
    """The demonstration cannot go on; the message says why and what to do."""


class NodeEndedError(DemoError):
    """One of the nodes has ended by itself."""
