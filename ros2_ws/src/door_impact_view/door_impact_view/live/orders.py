"""The orders that the page's buttons give to the nodes, and the nodes' answers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Push:
    """Push the simulated door; `impulse` about the hinge [N m s]."""

    impulse: float


@dataclass(frozen=True)
class Identify:
    """Identify the closer from the pushes so far."""


@dataclass(frozen=True)
class Plan:
    """Plan a hit.

    Attributes:
        angle: Desired opening angle [rad].
        run_up: Profile of the run-up; empty: as configured.
        ending: Motion after the door's peak; empty: as configured.
    """

    angle: float
    run_up: str
    ending: str


@dataclass(frozen=True)
class Run:
    """Execute the last plan."""


@dataclass(frozen=True)
class Stop:
    """Stop the motion as safely as the phase allows."""


@dataclass(frozen=True)
class Reset:
    """Put the simulated robot and door back to the start."""


Order = Push | Identify | Plan | Run | Stop | Reset


@dataclass(frozen=True)
class Answer:
    """What came of an order.

    Attributes:
        done: Whether it was done; False if it was refused or failed.
        text: A sentence, of the node that was asked or of this one.
    """

    done: bool
    text: str


Reply = Callable[[Answer], None]
GiveOrder = Callable[[Order, Reply], None]
"""Takes an order from any thread and returns at once; the reply is called later, once."""
