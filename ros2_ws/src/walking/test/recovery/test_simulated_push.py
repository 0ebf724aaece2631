"""Pushes on the walking robot in the simulated world: rubber soles, stabilizer, steps changed."""

import math

import numpy as np
import pytest
from door_model.door.config import load_door
from hrp2_sim_bridge.world import World
from humanoid_motion.driver_interface import TrajectoryArrays
from walking.recovery.estimate import watch
from walking.recovery.recovery import recover


def arrays(robot, knots):
    return TrajectoryArrays(
        robot.joint_names, knots.time.tolist(), knots.position.tolist(),
        knots.velocity.tolist(), knots.acceleration.tolist())


def walked(robot, plan, engine, push=None, when=math.inf, **settings):
    """Walk a plan and change it after a push [N s] at a time [s]; return the fall and changes."""
    world = World(robot.config, load_door("paper"), 8.0, -8.0, engine=engine, log=False, **settings)
    try:
        world.follow(arrays(robot, plan.knots), 0.0)
        found, seen, origin, changes = None, None, 0.0, []
        while world.time < origin + plan.duration + 1.0 and not world.fell:
            if push is not None and world.time >= when - 1e-9:
                world.push_robot(np.array([*push, 0.0]), 0.1)
                push = None
            sample = world.step()
            measured, time = sample.measured, sample.time - origin
            seen = watch(robot, plan, time, measured, before=seen)
            new = recover(robot, plan, time, measured, previous=found, seen=seen)
            if new is not None:
                origin += new.begin
                plan, found = new.plan, new
                world.follow(arrays(robot, plan.knots), origin)
                changes.append(new)
    finally:
        world.close()
    return str(world.fall.reason), changes


def middle_of(plan, step):
    phase = next(p for p in plan.schedule.phases if p.kind == "single" and p.step == step)
    return 0.5 * (phase.first + phase.last) * plan.schedule.period


@pytest.mark.nightly("ten seconds")
def test_a_push_to_the_swinging_foot_is_caught_by_a_wider_step(robot, walk_to):
    """A push of 25 N s, under which the robot falls without recovery; it stands afterwards."""
    plan = walk_to(0.8, 0.0, 0.0)
    fell, changes = walked(robot, plan, "pybullet", (0.0, 25.0), middle_of(plan, 2))
    assert fell == ""
    assert changes[-1].plan.final.at_rest


@pytest.mark.nightly("several walks")
@pytest.mark.parametrize(("engine", "friction", "rubber"), [
    ("pybullet", 0.4, 1.3), ("mujoco", 1.0, 0.7)])
def test_an_undisturbed_walk_is_never_changed(robot, walk_to, engine, friction, rubber):
    """Without a push no step is changed on slippery or soft ground, in an arc to the side."""
    plan = walk_to(0.6, 0.3, 40.0)
    fell, changes = walked(
        robot, plan, engine, friction=friction, rubber_scale=rubber)
    assert (fell, changes) == ("", [])
