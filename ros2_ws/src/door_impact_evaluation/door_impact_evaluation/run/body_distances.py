"""Distances of the simulated robot's bodies from leaf, frame and doorway, by the true log.

The bodies are the collision shapes of `humanoid_motion.clearance`, where the log's joints and base
have put them, with the base's whole orientation: 1 deg of tilt moves the head by 25 mm.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from door_model.door.config import DoorConfig
from humanoid_motion.clearance import LeafCourse, bodies_of
from humanoid_motion.pinocchio_model import coal
from humanoid_motion.robot_model import RobotModel
from walking.passing.doorway import Doorway

from door_impact_evaluation.run.record import Motion

_RATE = 50.0  # samples a second at which distances are computed [1/s]
_ROOM = 5.0  # extent of the room on the robot's side that must be left [m]


@dataclass(frozen=True)
class BodyDistances:
    """Distances of S bodies at K samples of a log; negative inside.

    Attributes:
        time: Times of the samples, (K,) [s].
        links: Names of the links of the bodies, (S,).
        leaf: Distances from the leaf, (K, S) [m].
        frame: Distances from the nearest part of frame and wall, (K, S) [m].
        beyond: How far the bodies are past the wall and outside the leaf's circle, whichever is
            less, (K, S) [m].
    """

    time: Array
    links: tuple[str, ...]
    leaf: Array
    frame: Array
    beyond: Array


def body_distances(
    robot: RobotModel, motion: Motion, door: DoorConfig, hinge: Sequence[float], since: float = 0.0
) -> BodyDistances:
    """Compute the distances.

    Args:
        robot: The robot.
        motion: The simulation's log.
        door: The simulated door, which has a frame.
        hinge: x and y of its hinge in odom, (2,) [m].
        since: Time from which they are computed [s].
    """
    assert door.frame is not None, door.name
    every = max(1, round(1.0 / (_RATE * float(np.median(np.diff(motion.t))))))
    rows = np.flatnonzero(motion.t >= since)[::every]
    bodies, leaf, (x, y) = bodies_of(robot), door.leaf, map(float, hinge)
    doorway, top = Doorway(np.array([x, y]), leaf, door.frame), 0.5 * _ROOM - 0.5
    radius = float(np.hypot(leaf.width, leaf.thickness))
    obstacles = [  # the leaf, the room before the wall's far face, the leaf's circle, frame, wall
        (coal.Box(leaf.width, leaf.thickness, leaf.height), (0.0, 0.0, 0.0)),
        (coal.Box(2.0 * _ROOM, _ROOM, _ROOM), (x, doorway.far_face + 0.5 * _ROOM, top)),
        (coal.Cylinder(radius, _ROOM), (x, y, top)),
        *((coal.Box(*box.size), box.center) for box in doorway.obstacles())]
    count = len(bodies.links)
    geometry, items = bodies.beside([shape for shape, _ in obstacles], range(count))
    for item, (_, middle) in zip(items, obstacles, strict=True):
        item.placement = pin.SE3(np.eye(3), np.array(middle))
    course = LeafCourse(np.array([x, y]), motion.door_angle[rows], leaf.width, leaf.height,
                        leaf.thickness)
    raised = np.array([0.0, 0.0, leaf.top - leaf.height])  # the course's leaf stands on the floor
    q = robot.configurations(motion.base_position[rows], motion.joints[rows])
    q[:, 3:7] = motion.base_orientation[rows]
    data, places = robot.model.createData(), geometry.createData()
    found = np.empty((len(rows), len(obstacles), count))
    for sample, distances in enumerate(found):
        pose = course.pose(sample)
        items[0].placement = pin.SE3(pose.rotation, pose.translation + raised)
        pin.computeDistances(robot.model, data, geometry, places, q[sample])
        distances[:] = np.reshape(
            [result.min_distance for result in places.distanceResults], distances.shape)
    return BodyDistances(
        motion.t[rows], bodies.links, leaf=found[:, 0], frame=found[:, 3:].min(axis=1),
        beyond=found[:, 1:3].min(axis=1))
