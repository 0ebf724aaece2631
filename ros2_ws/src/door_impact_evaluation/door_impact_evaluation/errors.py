"""Errors of the demonstration and of what is measured."""

from door_impact_common.errors import DoorImpactError


class EvaluationError(DoorImpactError):
    """Base of every error of this package."""


class DemoError(EvaluationError):
    """The demonstration cannot go on; the message says why and what to do."""


class NodeEndedError(DemoError):
    """One of the nodes has ended by itself."""
