"""What a passage begins with."""

from __future__ import annotations

from dataclasses import dataclass

from door_impact_common.arrays import Array
from door_model.door.door import Door

from walking.footsteps.footstep import Stance
from walking.passing.doorway import Doorway


@dataclass(frozen=True)
class PassageTask:
    """The door to pass, and the robot that holds it.

    Attributes:
        door: Dynamics of the door.
        doorway: Leaf and wall.
        angle: Opening angle of the leaf that the hand holds [rad].
        stance: The soles.
        joints: Joints of the robot, which stands still, (J,) [rad].
        measured: Joints as measured while the hand presses on the leaf, (J,) [rad]; they show where
            the door stands. None: it stands where the doorway says.
        attitude: Quaternion x, y, z, w of the IMU's frame then, (4,); the robot leans against the
            leaf. None: it stands upright.
    """

    door: Door
    doorway: Doorway
    angle: float
    stance: Stance
    joints: Array
    measured: Array | None = None
    attitude: Array | None = None
