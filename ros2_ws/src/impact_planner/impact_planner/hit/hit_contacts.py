"""Forces of the leaf on the elbow and of the trunk's pad on the arm's in a step of the hit.

Each contact is a spring and damper along its normal that cannot pull, and friction along its two
tangents. In a step of the implicit midpoint rule a spring-damper is a linear function of the
velocity in the middle of the step, f = a + b v. With the mobility W = G A^-1 G^T of the contacts'
rows, v = v_free - W f, so that the forces of the contacts that act are the solution of a small
linear system. Which ones act, and which slide, is found by trial, beginning with what they did in
the step before.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array

ROWS = 3  # rows of each contact: its normal, and two tangents
_TRIALS = 8  # largest number of trials in a step


@dataclass(frozen=True)
class ContactState:
    """What a contact does in a step.

    Attributes:
        acts: Whether it presses.
        slide: Unit direction along the tangents in which friction acts because it slides; None
            where it sticks.
    """

    acts: bool = True
    slide: tuple[float, float] | None = None


class Contacts:
    """Contacts, whose forces press against positive velocities of their rows.

    Args:
        mobility: Velocities of the rows by their forces, (3 C, 3 C) [m/s/N].
        slope: Forces by the rows' velocities within a step, (3 C,) [N s/m].
        friction: Coefficients of friction, (C,).
    """

    def __init__(self, mobility: Array, slope: Array, friction: Array) -> None:
        self._system = np.eye(len(slope)) + slope[:, None] * mobility
        self._identity = np.eye(len(slope))
        self._mobility, self._slope, self._friction = mobility, slope, friction.tolist()

    def solve(
        self, at_rest: Array, free: Array, states: list[ContactState]
    ) -> tuple[Array, list[ContactState]]:
        """Find the forces in a step.

        Args:
            at_rest: Forces of the rows' springs for rows without velocity, (3 C,) [N].
            free: Velocities of the rows without forces of contacts, (3 C,) [m/s].
            states: What the contacts did in the step before.

        Returns:
            Forces, (3 C,) [N], and what the contacts do.
        """
        # Only a force of the free motion's sign is a reason to press again.
        wanted = at_rest + self._slope * free
        states = [
            ContactState(bool(wanted[ROWS * number] > 0.0), state.slide if state.acts else None)
            for number, state in enumerate(states)]
        for _ in range(_TRIALS):
            force = self._forces(wanted, states)
            moves = free - self._mobility @ force
            found = [self._judged(number, state, force, moves)
                     for number, state in enumerate(states)]
            if [_kind(state) for state in found] == [_kind(state) for state in states]:
                return force, found
            states = found
        return force, states

    def _forces(self, wanted: Array, states: list[ContactState]) -> Array:
        """Solve for the forces, (3 C,) [N], of contacts in given states."""
        system, right = self._system, wanted
        for number, state in enumerate(states):
            if state.acts and state.slide is None:
                continue
            if system is self._system:
                system, right = system.copy(), right.copy()
            first = ROWS * number
            rows = slice(first + 1 if state.acts else first, first + ROWS)
            system[rows], right[rows] = self._identity[rows], 0.0
            if state.slide is not None:
                system[first + 1, first] = -self._friction[number] * state.slide[0]
                system[first + 2, first] = -self._friction[number] * state.slide[1]
        return np.asarray(np.linalg.solve(system, right))

    def _judged(
        self, number: int, state: ContactState, force: Array, moves: Array
    ) -> ContactState:
        """Judge what a contact does by the forces and velocities that its assumed state led to."""
        if not state.acts:
            return state
        first = ROWS * number
        normal, *along = force[first:first + ROWS].tolist()
        slip = moves[first + 1:first + ROWS].tolist()
        if state.slide is None:
            size = math.hypot(*along)
            if size <= self._friction[number] * normal:
                return state
            # A contact that would pull is first tried as one that slides.
            return ContactState(slide=(along[0] / size, along[1] / size)) if size else ContactState(
                acts=False)
        if normal <= 0.0:
            return ContactState(acts=False)
        speed = math.hypot(*slip)
        if state.slide[0] * slip[0] + state.slide[1] * slip[1] <= 0.0:
            return ContactState()
        return ContactState(slide=(slip[0] / speed, slip[1] / speed))


def _kind(state: ContactState) -> tuple[bool, bool]:
    return state.acts, state.slide is None
