"""Readings of the physics engine during a control tick, one for each millisecond."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES

from hrp2_sim_bridge.physics.engine import Engine
from hrp2_sim_bridge.physics.states import BodyState, DoorState, Reactions, Touch, in_turn
from hrp2_sim_bridge.sensors.wrench import outer_wrenches


@dataclass
class TickReadings:
    """Readings at the ends of milliseconds, in the form that costs the least time.

    Attributes:
        frames: `Engine.read_frames` at the start of the tick and after each millisecond; without a
            log, which alone needs those between, at start and end of the tick.
        joints: `Actuation.joints` after each millisecond; empty without a log.
        reactions: Forces and torques at the force sensors in the steps of each millisecond.
        door: State of the leaf after each millisecond.
        touches: Contact between robot and leaf in each millisecond.
    """

    frames: list[list[float]]
    joints: list[Array] = field(default_factory=list)
    reactions: list[list[Reactions]] = field(default_factory=list)
    door: list[DoorState] = field(default_factory=list)
    touches: list[Touch] = field(default_factory=list)

    @cached_property
    def mean_reactions(self) -> Array:
        """Means of the reactions over the steps of each millisecond, (T, B, 6)."""
        return np.asarray(np.array(self.reactions).mean(axis=1))

    def ends(self, engine: Engine) -> BodyState:
        """Return the states (2, 4) of `Engine.link_states` at the start and end of the tick."""
        return engine.link_states(np.array([self.frames[0], self.frames[-1]]))

    def wrenches(
        self, engine: Engine, ends: BodyState, hands: Sequence[BodyState], duration: float
    ) -> Array:
        """Compute the mean wrenches of the surroundings on soles and hands over the tick.

        Args:
            engine: Engine of the readings.
            ends: Link states at the start and end of the tick, from `ends`.
            hands: States of the hands at the start and end of the tick.
            duration: Duration of the tick [s].

        Returns:
            Forces [N] and torques [N m] on the bodies beyond force sensors, in their frames,
            (B, 6).
        """
        mean = self.mean_reactions.mean(axis=0)
        bodies = ends.at((slice(None), slice(len(SIDES)))).beside(in_turn(hands))
        return outer_wrenches(
            mean[None], bodies, duration, engine.sensed_mass, engine.sensed_inertia
        )[0]
