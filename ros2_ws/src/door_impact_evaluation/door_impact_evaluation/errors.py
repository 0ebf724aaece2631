"""Errors of the demonstration, the benchmarks and the evaluation of runs."""

from door_impact_common.errors import DoorImpactError


class EvaluationError(DoorImpactError):
    """Base of every error of this package."""


class DemoError(EvaluationError):
    """The demonstration cannot go on; the message says why and what to do."""


class BenchError(EvaluationError):
    """A benchmark could not be measured, or its result is not that of its peer."""


class RecordingError(EvaluationError):
    """A recording contains nothing that can be shown."""
