"""The simulated world as the robot's mirror image sees it: a door hinged at the left.

The simulation is that of the robot itself, which hits the door with its left arm, and so is its
log. Orders are taken and measurements are given as those of the image, for which motions are
planned.
"""

from dataclasses import replace
from typing import Any

from door_impact_common.arrays import Array
from hrp2_description.robot import RobotConfig
from hrp2_sim_bridge.sensors.sensors import TickSample
from hrp2_sim_bridge.world import World
from humanoid_motion.driver_interface import TrajectoryArrays
from humanoid_motion.mirror import OTHER, Mirror, places


class MirroredWorld(World):
    """A world with a door hinged at the left; arguments are those of `World`."""

    def __init__(self, robot: RobotConfig, *args: Any, **settings: Any) -> None:
        self._mirror = Mirror(robot)
        super().__init__(robot, *args, **settings)

    @property
    def commanded(self) -> Array:
        """Posture that the driver commands now, (J,) [rad]."""
        return self._mirror.joints(super().commanded)

    def follow(self, trajectory: TrajectoryArrays, stamp: float) -> None:
        """Accept a trajectory of the image, or refuse it as a whole."""
        if not trajectory.is_stop:
            trajectory = replace(trajectory, **{
                part: self._mirror.joints(getattr(trajectory, part)).tolist()
                for part in ("positions", "velocities", "accelerations")})
        super().follow(trajectory, stamp)

    def step(self) -> TickSample:
        """Advance by one control tick; return what the image measures by its end."""
        return self._mirror.sample(super().step())

    def push_robot(self, impulse: Array, duration: float = 0.1) -> None:
        """Push the image's center of mass; see `World.push_robot`."""
        super().push_robot(places(impulse), duration)

    def comply(self, side: str, *impedance: float) -> None:
        """Let a hand of the image yield; see `World.comply`."""
        super().comply(OTHER.get(side, side), *impedance)
