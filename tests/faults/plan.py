"""Draws of faults: what is disturbed, when, for how long and how; and what makes a run unsafe."""

from dataclasses import dataclass

import numpy as np
from robot_driver.intake import CURRENT
from robot_driver.names import DOOR, HAND, IMU, JOINTS, WRENCHES

HIT, WALK, PASSAGE = "hit", "walk", "passage"
SERVER, DRIVER, COMMANDS, ENCODER = "motion_server", "driver", "commands", "door_encoder"
DOOR_PERIOD = 0.02  # period of the messages about the door, the longest of all topics [s]
TOPICS = (JOINTS, IMU, DOOR, *WRENCHES.values())

# What can happen to each part. The driver is late, but it never ends: without it no robot stands.
KINDS = {
    SERVER: ("stopped", "killed", "asked to stop"),
    DRIVER: ("late",),
    ENCODER: ("stopped", "killed"),
    COMMANDS: ("delayed", "dropped", "duplicated"),
    **dict.fromkeys(TOPICS, ("delayed", "dropped", "duplicated", "NaN", "forged", "clock step")),
}
LEAF, ROBOT = "leaf", "robot"  # what people push
_BRIEF, _NONE = (0.1, 0.1), (0.0, 0.0)
IN_PASSAGE = (  # parts, what happens to them, for how long [s], and the impulse [N m s, N s]
    ((LEAF,), "pulled open", (0.2, 1.5), (4.0, 25.0)),
    ((LEAF,), "pushed shut", (0.2, 1.5), (-25.0, -4.0)),
    ((ROBOT,), "pushed", _BRIEF, (5.0, 20.0)),
    ((SERVER,), "asked to stop", _NONE, _NONE),
    ((JOINTS, IMU, DOOR, HAND), "dropped", (0.7, 3.0), _NONE))
FRICTIONS = (0.8, 0.6, 0.4)  # of the soles in passages
SHORTEST, LONGEST = 0.05, 5.0  # duration of a fault [s]
BEFORE, AFTER = 7.0, 3.0  # time before and after the planned contact at which a fault begins [s]
NEAR = 0.5  # share of the faults that begin within a second of the contact
ONCE = 0.5  # share of the faults of messages that affect a single message
SILENCE = 0.2  # duration of the driver's silence in `outages` [s]
GENTLE = 200.0  # largest mean force of hand and leaf after the hit, over 20 ms [N]


@dataclass(frozen=True)
class Fault:
    """A disturbance."""

    part: str  # part or topic that is disturbed
    kind: str  # what happens to it
    begin: float  # relative to the planned contact, else to the motion's planned end [s]
    length: float  # 0 means that a single message is affected [s]
    size: float  # delay, or error of the stamp [s]; impulse on leaf [N m s] or robot [N s]
    seed: int  # of forged values, and of a push's direction
    motion: str = HIT  # during which it happens

    @property
    def noticeable(self) -> bool:
        """Whether the node can notice it by its messages alone.

        It cannot notice a loss of less than `CURRENT`, nor what happens to its commands.
        """
        if self.kind == "dropped":
            return self.part in (*TOPICS, HAND) and self.length > CURRENT + DOOR_PERIOD
        return self.part in TOPICS or (
            self.part in (SERVER, ENCODER) and self.kind == "stopped"
            and self.length > CURRENT + DOOR_PERIOD)

    def __str__(self) -> str:
        """The disturbance in words."""
        long = f"for {self.length:.2f} s" if self.length else "once"
        end = "contact" if self.motion == HIT else f"end of the {self.motion}"
        by = f" by {self.size:.2f} s" if self.kind in ("delayed", "clock step") else ""
        if self.part in (LEAF, ROBOT):
            by = f" with {abs(self.size):.0f} {'N m s' if self.part == LEAF else 'N s'}"
        return f"{self.part} {self.kind}{by} {long}, {self.begin:+.2f} s from the {end}"


@dataclass(frozen=True)
class Verdict:
    """What the simulation's truth says of a run with a fault."""

    fault: Fault
    fell: str  # why the robot counts as fallen; empty if it stands
    hand: float  # largest mean force of robot and leaf after the hit, over 20 ms [N]
    peak: float  # largest angle of the door [rad]
    outcome: str  # how the execution ended
    reason: str  # its explanation
    touched: bool  # whether the robot touched the door
    through: bool  # whether the robot ended beyond the closed leaf
    warned: bool  # whether the plan warned that the robot falls if it misses the door
    noticed: dict[str, str]  # by the checks of the messages
    refused: list[str]  # by the driver

    def __str__(self) -> str:
        """The verdict in one line."""
        parts = [str(self.fault), self.outcome, f"hand {self.hand:.0f} N",
                 f"door {57.29578 * self.peak:.1f} deg", self.fell, self.reason]
        parts += [f"{what}: {value}" for what, value in self.noticed.items()]
        return "; ".join(part for part in (*parts, *self.refused) if part)

    @property
    def wrong(self) -> str:
        """What is wrong; empty if the robot stands, the hand is gentle and all is said.

        It may fall where it missed the door and the plan had warned of that. The hand that holds a
        leaf cannot be gentle to somebody who pushes it.
        """
        if self.fell and (self.touched or not self.warned):
            return f"the robot fell: {self.fell}"
        passage = self.fault.motion == PASSAGE
        if passage and self.outcome == "SUCCESS" and not self.through:
            return "the passage is said to have ended well, but the robot is not through"
        if self.hand > GENTLE and not passage:
            return f"the hand meets the leaf with {self.hand:.0f} N"
        if not (self.outcome == "SUCCESS" or self.fault.kind == "killed" or self.reason):
            return "the execution does not say what went wrong"
        if self.fault.noticeable and not (self.noticed or self.reason):
            return "the fault is named nowhere"
        return ""


NAMED = (
    Fault(SERVER, "stopped", -0.05, 3.0, 0.0, 0),
    Fault(COMMANDS, "delayed", 0.9, 1.5, 0.9, 0),
)
"""Faults that have thrown the door, or left the robot in its way."""


def draw(seed: int, count: int) -> list[Fault]:
    """Faults of a seed in a hit."""
    rng = np.random.default_rng(seed)

    def length() -> float:
        return float(np.exp(rng.uniform(np.log(SHORTEST), np.log(LONGEST))))

    faults = []
    for number in range(count):
        part = str(rng.choice((SERVER, SERVER, DRIVER, COMMANDS, ENCODER, *TOPICS)))
        kind = str(rng.choice(KINDS[part]))
        begin = _instant_of_hit(rng)
        once = part in TOPICS and rng.random() < ONCE
        faults.append(Fault(part, kind, begin, 0.0 if once else length(),
                            length() * float(rng.choice((-1.0, 1.0)))
                            if kind == "clock step" else length(), number))
    return faults


def outages(motion: str, lasts: float, seed: int, count: int) -> list[Fault]:
    """Deaths of the part that moves the robot, stops, and silences of all of the driver's topics.

    Each happens at `count` random instants of a hit, or of another motion of a duration [s].
    """
    rng = np.random.default_rng(seed)

    def instant() -> float:
        return _instant_of_hit(rng) if motion == HIT else float(rng.uniform(-lasts, 0.0))

    return [Fault(part, kind, instant(), SILENCE * (part == DRIVER), 0.0, number, motion)
            for part, kind in ((SERVER, "killed"), (SERVER, "asked to stop"), (DRIVER, "silent"))
            for number in range(count)]


def in_passage(lasts: float, seed: int, count: int) -> list[Fault]:
    """What people do in a passage of a duration [s], and silent topics, in turns."""
    rng = np.random.default_rng(seed)
    faults = []
    for number in range(count):
        parts, kind, length, size = IN_PASSAGE[number % len(IN_PASSAGE)]
        faults.append(Fault(
            str(rng.choice(parts)), kind, float(rng.uniform(-lasts, -1.0)),
            float(rng.uniform(*length)), float(rng.uniform(*size)), number, PASSAGE))
    return faults


def _instant_of_hit(rng: np.random.Generator) -> float:
    near = rng.random() < NEAR
    return float(rng.uniform(-1.0, 1.0) if near else rng.uniform(-BEFORE, AFTER))
