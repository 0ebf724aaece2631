"""What the hit demands of each joint's gear and motor, and the limits of the gears."""

from __future__ import annotations

from dataclasses import dataclass

from humanoid_motion.robot_model import RobotModel

from impact_planner.errors import GearOverload
from impact_planner.hit.hit_response import HitResponse


@dataclass(frozen=True)
class JointLoad:
    """Load of a joint in the hit.

    Attributes:
        joint: Name of the joint.
        gear_torque: Torque of the gear on the link where it is largest, with what it carries
            before the hit [N m].
        peak_torque: Momentary peak torque of the gear, which it bears a limited number of times
            [N m].
        ratcheting_torque: Torque at which the gear's teeth skip [N m].
        motor_impulse: Impulse of the motor's torque during the contact [N m s].
    """

    joint: str
    gear_torque: float
    peak_torque: float
    ratcheting_torque: float
    motor_impulse: float

    @property
    def share(self) -> float:
        """Largest torque of the gear as a share of its momentary peak torque."""
        return abs(self.gear_torque) / self.peak_torque


def joint_loads(robot: RobotModel, response: HitResponse) -> tuple[JointLoad, ...]:
    """Return the load of each joint, the largest share first; empty for rigid joints."""
    drives = robot.config.drives
    if drives is None:
        return ()
    rows = zip(
        robot.joint_names, response.gear.tolist(), drives.peak_torque.tolist(),
        drives.ratcheting_torque.tolist(), response.motor_impulse.tolist(), strict=True)
    loads = [JointLoad(*row) for row in rows]
    return tuple(sorted(loads, key=lambda load: -load.share))


def overload_warnings(loads: tuple[JointLoad, ...]) -> tuple[str, ...]:
    """Warn of gears that the hit loads beyond their momentary peak torque."""
    return tuple(
        f"the hit loads the gear of {load.joint} with {abs(load.gear_torque):.0f} N m, its "
        f"momentary peak torque is {load.peak_torque:.0f} N m; it bears this a limited number of "
        "times" for load in loads if load.share > 1.0)


def require_bearable(loads: tuple[JointLoad, ...]) -> None:
    """Check that no gear's teeth skip in the hit.

    Raises:
        GearOverload: The torque of a gear exceeds its ratcheting torque.
    """
    for load in loads:
        value = abs(load.gear_torque)
        if value > load.ratcheting_torque:
            raise GearOverload(
                f"the hit would load the gear of {load.joint} with {value:.0f} N m, but its teeth "
                f"skip at {load.ratcheting_torque:.0f} N m; request a smaller angle",
                quantity=f"gear torque of {load.joint} [N m]", value=value,
                limit=load.ratcheting_torque, phase="cam")
