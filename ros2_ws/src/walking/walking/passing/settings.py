"""Settings of a passage through a door."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeVar

from humanoid_motion.clearance import bodies_of
from humanoid_motion.robot_model import RobotModel

from walking.footsteps.rectangles import Rectangle
from walking.pattern.settings import WalkSettings

_Choice = TypeVar("_Choice")

_SHOULDER = 2  # joints of an arm whose links do not reach out in front of the trunk


class Gait(NamedTuple):
    """How the body walks, apart from the time of its steps.

    Attributes:
        waist_height: Height of base_link above the floor [m].
        zmp_inward: As in `WalkSettings` [m].
        first_inward: As in `WalkSettings` [m].
        required_margin: As in `WalkSettings` [m].
    """

    waist_height: float
    zmp_inward: float
    first_inward: float
    required_margin: float

    def scaled(self, tall: float, wide: float) -> Gait:
        """Return the gait of a robot whose height and soles are `tall` and `wide` times HRP-2's."""
        return Gait(self.waist_height * tall, *(wide * each for each in self[1:]))


class Way(NamedTuple):
    """What a search for a passage chooses among the settings.

    Attributes:
        leaf_angle: One of `PassageSettings.leaf_angles` [rad].
        wider: One of `PassageSettings.wider` [m].
        gait: One of `PassageSettings.gaits`.
    """

    leaf_angle: float
    wider: Rectangle
    gait: Gait


@dataclass(frozen=True)
class PassageSettings:
    """Settings of a passage. The robot walks ahead along the leaf, which is at its right.

    Attributes:
        leaf_angles: Opening angles at which the robot may pass, in the order of preference [rad].
        body: Robot with the left arm tucked in and without the right one beyond the shoulder, seen
            from above from the middle between the soles; the default is HRP-2's [m].
        wider: By how much this rectangle is larger at the back, ahead, at the right and at the
            left, tried in this order where a body would come too near to leaf or frame [m].
        gap: Distance of this rectangle from walls and leaf [m].
        gap_cost: How many steps more the robot makes rather than use this distance up.
        foot_gap: Distance of the soles from the walls [m].
        threshold_gap: Distance of a standing sole from a threshold [m].
        over_threshold: Smallest distance of a swinging sole from it [m].
        lift_over: Height of the swing foot in the middle of a step where there is a threshold [m].
        reach: Distance of the right shoulder from the leaf's face up to which the hand opens it
            [m].
        leaf_step: Largest opening of the leaf in the time of one step [rad].
        durations: Shortest and longest duration of a step [s]; a step lasts longer than the
            shortest one where a joint would be too fast or the soles would slip (`tempo.py`).
        gaits: Gaits, tried in this order: the wide stance after a hit demands a lower waist than
            other walks, and more so in long steps, which leave a leg too short; a ZMP farther
            inwards spares the legs, which the first step asks most of, and costs margin.
        stop_margin: As a gait's `required_margin`, for a robot that comes to rest before the end
            of its passage: it must not be refused a stop [m].
        chest_swing: Turn of the upper body per distance between the feet [rad/m].
        friction: Coefficient of friction between soles and floor that may be used; the closer's
            torque on the hand turns the robot.
        start: Time from rest to the first step where nothing presses on the hand [s].
        settling: By how much this time is longer per force of the held leaf on the hand: the hand
            begins to yield then, and what it does to the ZMP has to fade before a foot lifts
            [s/N].
        hand_stiffness: Stiffness with which the hand yields to the leaf [N/m]; infinite: it does
            not. The hand's planned place is behind the leaf's face by what it will have yielded.
        hand_damping: Damping of the yielding hand [N s/m].
        hand_mass: Virtual mass of the yielding hand [kg].
        hand_farthest: Largest displacement that the driver of a yielding hand allows [m].
        hand_fastest: Largest speed of that displacement that the driver allows [m/s].
        hand_heights: Lowest and highest place of the hand above the floor [m].
        nearest: Smallest distance of the hand from the hinge [m].
        hand_radius: Distance of the hand from the hinge that is aimed at [m].
        clearance: Distance that bodies which do not hold the leaf keep from it and from the frame
            [m].
        forearm: Distance that the forearm keeps from leaf and frame, and the hand from the frame
            [m].
        held: Friction and clearances [m] that are tried where the robot holds the leaf already and
            there is no other passage: then it could only stand there.
        held_gaits: Gaits that are tried as well with these.
        weak: Force of the held leaf on the hand up to which the first of these clearances will do,
            too: a robot that has not moved uses it at last, and one that waits with the leaf in its
            hand at once [N]. A stronger leaf turns the robot while it walks, so that it comes up to
            5 deg behind its plan.
    """

    leaf_angles: tuple[float, ...] = tuple(map(math.radians, (75.0, 80.0, 70.0)))
    body: Rectangle = (-0.247, 0.235, -0.320, 0.327)
    wider: tuple[Rectangle, ...] = (
        (0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.02, 0.0), (0.0, 0.0, 0.0, 0.02))
    gap: float = 0.05
    gap_cost: float = 1.0
    foot_gap: float = 0.02
    threshold_gap: float = 0.015
    over_threshold: float = 0.008
    lift_over: float = 0.09
    reach: float = 0.40
    leaf_step: float = math.radians(25.0)
    durations: tuple[float, float] = (0.66, 1.3)
    gaits: tuple[Gait, ...] = (
        Gait(0.58, 0.03, 0.03, 0.02), Gait(0.575, 0.03, 0.035, 0.02),
        Gait(0.575, 0.03, 0.04, 0.015))
    stop_margin: float = 0.005
    chest_swing: float = 0.5
    friction: float = 0.45
    start: float = 0.6
    settling: float = 0.012
    hand_stiffness: float = 400.0
    hand_damping: float = 400.0
    hand_mass: float = 10.0
    hand_farthest: float = 0.12
    hand_fastest: float = 0.5
    hand_heights: tuple[float, float] = (0.55, 1.25)
    nearest: float = 0.30
    hand_radius: float = 0.72
    clearance: float = 0.04
    forearm: float = 0.005
    held: tuple[tuple[float, float], ...] = ((0.5, 0.03), (0.5, 0.018))
    held_gaits: tuple[Gait, ...] = (
        Gait(0.57, 0.03, 0.04, 0.015), Gait(0.575, 0.04, 0.04, 0.015), Gait(0.57, 0.04, 0.04, 0.01),
        Gait(0.575, 0.05, 0.05, 0.005))
    weak: float = 13.0

    @classmethod
    def of(cls, robot: RobotModel, **own: Any) -> PassageSettings:
        """Return HRP-2's defaults by a robot's build, with its own body, and `own` as it is."""
        config, tall, wide = robot.config, robot.height_scale, robot.config.sole_scale
        arm = robot.shoulder_scale

        def larger(lengths: Any) -> Any:
            return tuple(map(larger, lengths)) if isinstance(lengths, tuple) else arm * lengths

        lengths = ("wider", "gap", "lift_over", "reach", "hand_heights", "nearest", "hand_radius",
                   "clearance")
        tucked = config.posture(config.tucked_posture, config.half_sitting)
        scaled = {name: larger(getattr(cls, name)) for name in lengths} | {
            "body": bodies_of(robot).seen_from_above(tucked, config.arm.joints[_SHOULDER:]),
            "gaits": tuple(gait.scaled(tall, wide) for gait in cls.gaits),
            "held_gaits": tuple(gait.scaled(tall, wide) for gait in cls.held_gaits),
            "held": tuple((friction, larger(clearance)) for friction, clearance in cls.held),
            "stop_margin": wide * cls.stop_margin, "foot_gap": wide * cls.foot_gap,
            "chest_swing": cls.chest_swing / tall, "weak": config.mass_scale * cls.weak}
        return cls(**scaled | own)

    @property
    def yields(self) -> bool:
        """Whether the hand yields to the leaf."""
        return math.isfinite(self.hand_stiffness)

    @property
    def impedance(self) -> tuple[float, float, float]:
        """Stiffness [N/m], damping [N s/m] and mass [kg] of the yielding hand."""
        return self.hand_stiffness, self.hand_damping, self.hand_mass

    def widened(self, wider: Rectangle) -> PassageSettings:
        """Return these settings with a larger body, as `wider` has it."""
        (back, ahead, right, left), more = self.body, wider
        return replace(self, body=(
            back - more[0], ahead + more[1], right - more[2], left + more[3]))

    def tried(self, force: float, held: bool) -> list[PassageSettings]:
        """Return the settings with which a way is looked for in turn.

        Args:
            force: Force of the held leaf on the hand [N].
            held: Whether the robot holds the leaf already.
        """
        nearer = replace(self, clearance=self.held[0][1])
        weak = force <= self.weak
        if not held:
            return [self, nearer] if weak else [self]
        return [nearer if weak else self, *(
            replace(self, friction=friction, clearance=clearance,
                    gaits=self.gaits + self.held_gaits) for friction, clearance in self.held)]

    def beginning_with(self, way: Way) -> PassageSettings:
        """Return these settings in an order in which a way is tried first."""
        def ordered(among: tuple[_Choice, ...], first: _Choice) -> tuple[_Choice, ...]:
            return tuple(sorted(among, key=lambda each: each != first))

        return replace(self, leaf_angles=ordered(self.leaf_angles, way.leaf_angle),
                       wider=ordered(self.wider, way.wider), gaits=ordered(self.gaits, way.gait))

    def walk(self, robot: RobotModel, gait: Gait, force: float) -> WalkSettings:
        """Return the settings of the walk with a gait, and a force of the held leaf [N]."""
        return WalkSettings.of(
            robot, start=self.start + self.settling * force, waist_height=gait.waist_height,
            chest_swing=self.chest_swing, zmp_inward=gait.zmp_inward,
            first_inward=gait.first_inward, required_margin=gait.required_margin,
            friction=self.friction)
