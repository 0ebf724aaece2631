"""Walks in the simulated world, judged by its truth: rubber soles, stabilizer, door far away."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from door_model.door.config import load_door
from hrp2_description.robot import SIDES
from hrp2_description.support import polygon_margin, sole_corners, support_polygon
from hrp2_sim_bridge.world import World
from humanoid_motion.driver_interface import TrajectoryArrays
from humanoid_motion.zmp import zmp_of
from walking.footsteps.footstep import Pose
from walking.pattern.plan import plan_walk


@dataclass(frozen=True)
class Walked:
    """What a simulated walk came to.

    `off` is the pose of the middle between the soles as seen from where it was planned, `slip` the
    largest way of a standing sole in a single support [m].
    """

    fell: str
    tilt_deg: float
    margin: float
    off: Pose
    slip: float


def heading(quaternions):
    x, y, z, w = quaternions.T
    return np.unwrap(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))


def zmp_margins(robot, log, rows, window=20):
    """Return the ZMP's distance from the edge of the loaded soles at rows, wrenches over 20 ms."""
    kernel = np.ones(window) / window
    mean = {side: np.column_stack([np.convolve(column, kernel, "same")
                                   for column in log[f"{side}_wrench"].T]) for side in SIDES}
    found = []
    for row in rows:
        force, moment, soles = np.zeros(3), np.zeros(3), {}
        for side in SIDES:
            place = log[f"{side}_sole_position"][row]
            yaw = heading(log[f"{side}_sole_quaternion"][row : row + 1])[0]
            cos, sin = np.cos(yaw), np.sin(yaw)
            (_, _, f, mx, my, _) = mean[side][row]
            force[2] += f
            moment[:2] += [cos * mx - sin * my + place[1] * f, sin * mx + cos * my - place[0] * f]
            soles[side] = (f, sole_corners(robot.config.soles[side], (place[0], place[1], yaw)))
        if force[2] > 0.2 * robot.mass * GRAVITY:
            hull = support_polygon(*(c for f, c in soles.values() if f > 0.05 * force[2]))
            found.append(float(polygon_margin(zmp_of(force, moment), hull)))
    return np.array(found)


def simulate(robot, plan, engine, later=(), prepare=None, push=None, **settings):
    """Walk a plan from time 0 and judge it two seconds after its end.

    Each of `later` is a time [s] and a plan that replaces what is followed from that time on; it is
    sent 20 ms before. `prepare` may change the world before the walk, and `push` is a time [s] and
    an impulse on the robot [N s], which takes 0.1 s.
    """
    world = World(robot.config, load_door("paper"), 8.0, -8.0, engine=engine, **settings)
    try:
        if prepare is not None:
            prepare(world)
        waiting = [(0.0, plan), *later]
        end = waiting[-1][0] + waiting[-1][1].duration
        while world.time < end + 2.0 and not world.fell:
            if push is not None and world.time >= push[0]:
                world.push_robot(np.array(push[1]))
                push = None
            if waiting and world.time >= waiting[0][0] - 0.021:
                start, new = waiting.pop(0)
                knots = new.knots
                world.follow(TrajectoryArrays(
                    robot.joint_names, knots.time.tolist(), knots.position.tolist(),
                    knots.velocity.tolist(), knots.acceleration.tolist()), start)
            world.step()
        log = world.log()
    finally:
        world.close()
    return judged(robot, log, later[-1][1].stance.middle if later else plan.stance.middle, plan)


def judged(robot, log, goal, plan):
    """Judge a log by the goal; slip is that of the single supports of the first plan."""
    places = {side: log[f"{side}_sole_position"] for side in SIDES}
    start, end = (0.5 * sum(places[side][row, :2] for side in SIDES) for row in (0, -1))
    yaw = float(np.mean([heading(log[f"{side}_sole_quaternion"])[-1] for side in SIDES]))
    off = Pose(*(end - start), yaw).seen_from(goal)
    slips = []
    for phase in plan.schedule.phases:
        rows = [min(round(1e3 * plan.schedule.period * n), len(log["time"]) - 1)
                for n in (phase.first, phase.last)]
        if phase.kind == "single":
            begin, last = places[phase.sides[0]][rows][:, :2]
            slips.append(float(np.linalg.norm(last - begin)))
    x, y = log["base_quaternion"][:, :2].T
    tilt = np.arccos(np.clip(1.0 - 2.0 * (x**2 + y**2), -1.0, 1.0))
    margin = zmp_margins(robot, log, range(100, len(log["time"]) - 50, 5))
    return Walked(str(log["fall_reason"]), math.degrees(tilt.max()), float(margin.min()), off,
                  max(slips))


def assert_walked(found, way):
    """The robot stands at its goal within 2 % of the way and 3 deg, and never nearly fell."""
    assert found.fell == ""
    assert found.tilt_deg < 5.0
    assert found.margin > 0.015
    assert math.hypot(found.off.x, found.off.y) < max(0.02 * way, 0.01)
    assert abs(math.degrees(found.off.yaw)) < 3.0
    assert found.slip < 0.002


@pytest.mark.nightly("tens of seconds each")
@pytest.mark.parametrize(("engine", "goal", "way"), [
    ("mujoco", (5.0, 0.0, 0.0), 5.0), ("mujoco", (0.0, -2.0, 0.0), 2.0),
    ("pybullet", (0.0, 0.0, 360.0), 2.5), ("pybullet", (1.5, 1.0, 90.0), 2.0)])
def test_long_walks_end_where_they_were_planned(robot, walk_to, engine, goal, way):
    """Ahead, sideways, a whole turn and an arc; turns end within 50 mm."""
    plan = walk_to(*goal, keep_heading=True, whole_turns=True)
    assert_walked(simulate(robot, plan, engine), way)


@pytest.mark.nightly("tens of seconds")
def test_a_walk_that_is_planned_anew_at_every_step_and_then_stopped(robot, walk_to):
    """Two steps ahead at a time, each plan ends at rest; the last one has no further step."""
    whole = walk_to(1.6, 0.3, 40.0)
    later, state, time = [], whole.boundaries[0], whole.begin_of(0)
    stop = 6
    for step in range(stop):
        plan = plan_walk(robot, state, whole.footsteps[step : step + 2])
        later.append((time, plan))
        state, time = plan.boundaries[1], time + plan.begin_of(1)
    later.append((time, plan_walk(robot, state, [])))
    found = simulate(robot, whole, "mujoco", later)
    assert_walked(found, 1.0)


def plate(x, y, top):
    """Return a function that lays a plate of 0.28 x 0.18 m under one footstep, in PyBullet."""
    def lay(world):
        client = world.engine.client
        shape = client.createCollisionShape(client.GEOM_BOX, halfExtents=[0.14, 0.09, 0.05])
        body = client.createMultiBody(0.0, shape, basePosition=[x, y, top - 0.05])
        client.changeDynamics(body, -1, lateralFriction=0.8, restitution=0.0)

    return lay


@pytest.mark.nightly("ten seconds")
def test_a_foot_that_lands_early_on_a_plate_is_not_pressed_on(robot, walk_to):
    """A plate of 10 mm under the third of four footsteps; pressed on, it took the whole margin."""
    plan = walk_to(0.6, 0.0, 0.0)
    place = plan.footsteps[2].pose
    found = simulate(robot, plan, "pybullet", prepare=plate(place.x + 0.015, place.y, 0.010))
    assert_walked(found, 0.6)
    assert found.tilt_deg < 0.8
