"""Settings of a demonstration, which a command line or a node's parameters fill in."""

from dataclasses import dataclass
from pathlib import Path

PASS = "pass"
"""Ending after which the robot walks through the door that it holds."""
STANDS = 2.5
"""Time after a passage in which the robot must go on standing [s]."""


@dataclass(frozen=True)
class DemoSettings:
    """What a demonstration shall do.

    Attributes:
        door: Name or YAML file of the simulated door; its parameters are compared with those found.
        target_deg: Desired opening angle [deg].
        ending: What follows the door's peak: hold, retreat or pass.
        run_up: Profile of the run-up, mcv50 or zmp_limited.
        hits: Number of hits; robot and door start anew before each, the results are the last one's,
            and only the last one is followed by a passage.
        out: Folder in which the results are written.
    """

    door: str
    target_deg: float
    ending: str
    run_up: str
    hits: int
    out: Path
