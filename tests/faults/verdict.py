"""What a run with a fault came to, and what makes it unsafe."""

from dataclasses import dataclass, field

from faults.plan import Fault

GENTLE = 200.0  # largest mean force of hand and leaf after the hit, over 20 ms [N]


@dataclass(frozen=True)
class Verdict:
    """What the simulation's truth says of a run with a fault."""

    fault: str  # in words
    fell: str  # why the robot counts as fallen; empty if it stands
    hand: float  # largest mean force of robot and leaf after the hit, over 20 ms [N]
    peak: float  # largest angle of the door [rad]
    outcome: str  # how the execution ended
    reason: str  # its explanation
    touched: bool  # whether the robot touched the door
    warned: bool  # whether the plan warned that the robot falls if it misses the door
    noticed: dict[str, str] = field(default_factory=dict)  # by the checks of the messages
    refused: list[str] = field(default_factory=list)  # by the driver

    def __str__(self) -> str:
        """The verdict in one line."""
        parts = [self.fault, self.outcome, f"hand {self.hand:.0f} N",
                 f"door {57.29578 * self.peak:.1f} deg", self.fell, self.reason]
        parts += [f"{what}: {value}" for what, value in self.noticed.items()]
        return "; ".join(part for part in (*parts, *self.refused) if part)


def wrong(fault: Fault, verdict: Verdict) -> str:
    """What is wrong with a run; empty if the robot stands, the hand is gentle and all is said.

    It may fall where it missed the door and the plan had warned of that.
    """
    if verdict.fell and (verdict.touched or not verdict.warned):
        return f"the robot fell: {verdict.fell}"
    if verdict.hand > GENTLE:
        return f"the hand meets the leaf with {verdict.hand:.0f} N"
    ended = verdict.outcome == "SUCCESS" or "killed" in verdict.fault
    if not (ended or verdict.reason):
        return "the execution does not say what went wrong"
    if fault.noticeable and not (verdict.noticed or verdict.reason):
        return "the fault is named nowhere"
    return ""
