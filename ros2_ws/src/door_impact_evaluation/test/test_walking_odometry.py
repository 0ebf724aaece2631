"""The odometry of simulated walks, compared with the simulation's truth at every tick.

`-s` prints the figures of docs/walking.md.
"""

import math
from collections import namedtuple
from dataclasses import replace

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from door_model.door.config import load_door
from hrp2_description.robot import SIDES, load_robot_config
from hrp2_description.support import polygon_margin, sole_corners, support_polygon
from hrp2_sim_bridge.physics.frames import rotation
from hrp2_sim_bridge.world import World
from humanoid_motion.driver_interface import TrajectoryArrays
from humanoid_motion.kinematics import planar_pose, yaw_of
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.zmp import zmp_of
from robot_driver.foot_doubts import FootDoubts, lifted
from walking.footsteps.footstep import Pose, Stance
from walking.footsteps.planner import plan_footsteps
from walking.pattern.plan import plan_walk
from walking.pattern.state import standing
from zmp_publisher.odometry import FootOdometry
from zmp_publisher.zmp_estimator import ZmpEstimator, wrench_in_world

ROBOT = load_robot_config()
WEIGHT = ROBOT.mass * GRAVITY
EVERY_TICK = 5  # rows of the log in a tick
SETTLED = 100  # ticks before the walk begins
START = (4.0, -3.0, 2.5)


Walk = namedtuple("Walk", "ticks log footsteps")  # sensors; the truth at each tick's end; number


@pytest.fixture(scope="module")
def walked():
    """A function that simulates a walk of the planner to x, y [m] and yaw [deg]."""
    model = RobotModel(ROBOT)
    stance = Stance.around(Pose(0.0, 0.0, 0.0), ROBOT.footsteps.width)

    def run(engine, x, y, yaw_deg, **settings):
        goal = Pose(x, y, math.radians(yaw_deg))
        steps = plan_footsteps(ROBOT, stance, goal, keep_heading=True, whole_turns=True)
        plan = plan_walk(model, standing(model, stance), steps)
        knots = plan.knots
        world = World(ROBOT, load_door("paper"), 8.0, -8.0, engine=engine, **settings)
        try:
            world.follow(TrajectoryArrays(
                ROBOT.joint_names, knots.time.tolist(), knots.position.tolist(),
                knots.velocity.tolist(), knots.acceleration.tolist()), 0.005 * SETTLED)
            ticks = [world.step() for _ in range(SETTLED + round((plan.duration + 2.0) / 0.005))]
            assert not world.fell
            log = world.log()
        finally:
            world.close()
        per_tick = {name: log[name][EVERY_TICK - 1 :: EVERY_TICK] for name in (
            "base_position", "base_quaternion", "com_position",
            *(f"{side}_sole_{what}" for side in SIDES for what in ("position", "quaternion")))}
        return Walk(ticks, per_tick, len(steps))

    return run


def followed(walk, *, with_imu=True, every=1, start=(0.0, 0.0, 0.0)):
    """Return RobotPose, CoM and ZmpReading at every tick of a walk, as the node computes them."""
    model = RobotModel(ROBOT)
    odometry = FootOdometry(model, loaded_force=0.05 * WEIGHT, start=start)
    zmp = ZmpEstimator(WEIGHT, ROBOT.soles)
    found = []
    for tick in walk.ticks[every - 1 :: every]:
        wrenches = {"left": tick.left_wrench, "right": tick.right_wrench}
        forces = {side: row[2] for side, row in wrenches.items()}
        imu = tick.imu if with_imu else None
        pose = odometry.update(tick.position, forces, imu, tick.time)
        com = pose.base[:3, :3] @ model.com(model.configuration(np.zeros(3), tick.position))
        com += pose.base[:3, 3]
        found.append((pose, com, zmp.read(pose.soles, wrenches)))
    return found


Errors = namedtuple("Errors", "end place height heading tilt jump")


def errors(walk, found, every=1):
    """Compare the poses with the truth: what has gone wrong since the walk began [m, rad].

    Of `end`, in the robot's own axes there, ahead, left and heading; of others the largest on the
    way; of `jump` from a tick to the next.
    """
    truth = rotation(walk.log["base_quaternion"])[every - 1 :: every]
    place = walk.log["base_position"][every - 1 :: every]
    base = np.array([pose.base for pose, _, _ in found])
    heading = np.array([math.remainder(yaw_of(one) - yaw_of(other), math.tau)
                        for one, other in zip(base, truth, strict=True)])
    begin = SETTLED // every - 1
    # What the odometry did not know of the start turns with the whole way.
    turn = planar_pose(0.0, 0.0, -heading[begin])[:3, :3]
    off = (base[:, :3, 3] - base[begin, :3, 3]) @ turn.T - (place - place[begin])
    height = base[:, 2, 3] - place[:, 2]
    heading = heading - heading[begin]
    off, heading, height = off[begin:], heading[begin:], height[begin:]
    at_end = planar_pose(0.0, 0.0, -yaw_of(truth[-1]))[:2, :2] @ off[-1, :2]
    upright = np.einsum("ti,ti->t", base[:, 2, :3], truth[:, 2, :])
    return Errors(
        np.array([*at_end, heading[-1]]),
        float(np.linalg.norm(off[:, :2], axis=1).max()), float(np.abs(height).max()),
        float(np.abs(heading).max()), float(np.arccos(np.clip(upright, -1.0, 1.0)).max()),
        float(np.linalg.norm(np.diff(off[:, :2], axis=0), axis=1).max()))


def figures(errors, walk):
    """One line for people."""
    ahead, left = 1e3 * errors.end[:2]
    return (f"{walk.footsteps} steps: end ahead {ahead:.1f} mm, left {left:.1f} mm, yaw "
            f"{math.degrees(errors.end[2]):.2f} deg; on the way {1e3 * errors.place:.1f} mm, "
            f"height {1e3 * errors.height:.1f} mm, yaw {math.degrees(errors.heading):.2f} deg, "
            f"tilt {math.degrees(errors.tilt):.2f} deg, jump {1e3 * errors.jump:.2f} mm")


@pytest.fixture(scope="module", params=[
    "mujoco", pytest.param("pybullet", marks=pytest.mark.nightly("another engine"))])
def arc(request, walked):
    """Some steps ahead and to the left that end turned by 40 deg, from a start elsewhere."""
    return walked(request.param, 0.4, 0.2, 40.0, start=START)


@pytest.fixture(scope="module")
def found(arc):
    """What the node would publish at every tick of that walk."""
    return followed(arc, start=START)


def test_poses_of_a_walk_are_the_true_ones(arc, found):
    """At every tick of a turning walk, from a start far from the origin, with noisy sensors."""
    off = errors(arc, found)
    for side in SIDES:  # not only changes of place
        place = arc.log[f"{side}_sole_position"][SETTLED]
        assert found[SETTLED][0].soles[side][:2, 3] == pytest.approx(place[:2], abs=0.002)
    assert off.place < 0.004
    assert off.height < 0.003
    assert math.degrees(off.heading) < 0.2
    assert math.degrees(off.tilt) < 0.4
    assert off.jump < 0.001


def test_the_imu_is_what_sees_the_rubber_tilt(arc, found):
    """Without it, tilt and place on the way are far worse; the end is within 2 % all the same."""
    with_imu = errors(arc, found)
    without = errors(arc, followed(arc, with_imu=False, start=START))
    assert without.tilt > 3.0 * with_imu.tilt
    assert without.place > 3.0 * with_imu.place
    assert np.linalg.norm(without.end[:2]) < 0.02 * math.hypot(0.4, 0.2)


def test_com_and_zmp_are_the_true_ones(arc, found):
    """To some millimetres in odom, while the robot walks and turns."""
    com = np.array([com for _, com, _ in found])[SETTLED:]
    assert np.linalg.norm(com - arc.log["com_position"][SETTLED:], axis=1).max() < 0.005
    for row in range(SETTLED, len(found)):
        total = np.zeros(6)
        for side in SIDES:
            pose = np.eye(4)
            pose[:3, :3] = rotation(arc.log[f"{side}_sole_quaternion"][row])
            pose[:3, 3] = arc.log[f"{side}_sole_position"][row]
            total += wrench_in_world(getattr(arc.ticks[row], f"{side}_wrench"), pose)
        assert found[row][2].point == pytest.approx(zmp_of(total[:3], total[3:]), abs=0.005)


def test_the_support_polygon_is_that_of_the_soles_that_bear_load(arc, found):
    """One sole or both, each with its own heading, at its true place to 5 mm."""
    seen, apart = set(), 0.0
    for row in range(SETTLED, len(found)):
        pose, _, reading = found[row]
        seen.add(reading.loaded)
        apart = max(apart, abs(yaw_of(pose.soles["left"]) - yaw_of(pose.soles["right"])))
        forces = {side: getattr(arc.ticks[row], f"{side}_wrench")[2] for side in SIDES}
        # A sole's force against gravity is less than that in its own axis by the tilt.
        if any(abs(force - 0.05 * WEIGHT) < 1.0 for force in forces.values()):
            continue
        truth = support_polygon(*(
            sole_corners(ROBOT.soles[side], (
                *arc.log[f"{side}_sole_position"][row][:2],
                yaw_of(rotation(arc.log[f"{side}_sole_quaternion"][row]))))
            for side in SIDES if forces[side] > 0.05 * WEIGHT))
        assert polygon_margin(truth, reading.polygon).min() > -0.005
        assert polygon_margin(reading.polygon, truth).min() > -0.005
    assert seen == {("left",), ("right",), ("left", "right")}
    assert apart > 0.1


@pytest.mark.parametrize(("part", "factor", "offset", "told"), [
    ({}, 1.0, 0.0, {}),
    ({"left": [2]}, 1.0, 45.0, {"left": "force.z"}),
    ({"right": [2]}, 1.0, -60.0, {"right": "force.z"}),
    ({"right": [0]}, 1.0, 20.0, {"right": "force.x"}),
    ({"left": [3, 4], "right": [3, 4]}, -1.0, 0.0, dict.fromkeys(
        SIDES, "(-torque.x, -torque.y) fits")),
    ({"right": [4]}, -1.0, 0.0, {"right": "(torque.x, -torque.y) fits"})])
def test_a_foots_sensor_that_lies_is_named_in_a_walk(arc, found, part, factor, offset, told):
    """Its value is that of the lifted foot, which supports nothing; a good one is not doubted."""
    def wrong(tick):
        rows = {side: getattr(tick, f"{side}_wrench").copy() for side in SIDES}
        for side, columns in part.items():
            rows[side][columns] = factor * rows[side][columns] + offset
        return replace(tick, **{f"{side}_wrench": row for side, row in rows.items()})

    ticks = list(map(wrong, arc.ticks))
    watch, seen = FootDoubts(RobotModel(ROBOT)), followed(arc._replace(ticks=ticks), start=START)
    for tick, (pose, _, reading), (before, _, _) in zip(ticks, seen, found, strict=True):
        watch.add(tick.measured, pose.base, pose.soles)
        assert lifted(pose.soles) not in reading.loaded
        assert pose.base == pytest.approx(before.base, abs=2e-3)
    doubts = {each.topic.removesuffix("_foot/wrench"): each for each in watch.found}
    assert set(doubts) == set(told)
    for side, doubt in doubts.items():
        assert told[side] in doubt.text
        assert not offset or doubt.value == pytest.approx(offset, abs=0.5)


@pytest.mark.nightly("tens of seconds each")
@pytest.mark.parametrize(("engine", "goal", "way"), [
    ("mujoco", (5.0, 0.0, 0.0), 5.0), ("pybullet", (0.0, 0.0, 360.0), 0.0)])
def test_long_walks_do_not_drift(walked, engine, goal, way):
    """At most 3 mm and 0.3 % of the way, 0.05 deg and 0.01 deg a step, on every floor."""
    walk = walked(engine, *goal, friction=0.4)
    found = errors(walk, followed(walk))
    print(f"\n{engine} {goal}: {figures(found, walk)}")
    print(f"    without IMU {figures(errors(walk, followed(walk, with_imu=False)), walk)}")
    assert np.linalg.norm(found.end[:2]) < 0.003 + 0.003 * way
    assert abs(math.degrees(found.end[2])) < 0.01 * walk.footsteps + 0.05
    assert math.degrees(found.tilt) < 0.5
    assert found.jump < 0.001
