import numpy as np
import pytest

SWAY_TIMES = np.array([0.1, 0.5, 0.9, 1.3])
SWAY = (0.0, 0.04, -0.04, 0.0)


def run(world, seconds):
    """Step for a number of seconds; return the log."""
    for _ in range(round(seconds / 0.005)):
        world.step()
    return world.log()


def swaying(world, sway, moving, slower=1.0):
    """Start a sway from foot to foot."""
    postures = np.array([sway(y) for y in SWAY])
    world.follow(moving(SWAY_TIMES * slower, postures), 0.0)


def test_joints_follow_a_quick_motion_within_their_windup(make_world, robot, moving) -> None:
    """An arm raised at almost its largest speed follows to 5 mrad, 3 mm at 0.6 m."""
    world = make_world()
    up = robot.posture({"LARM_JOINT0": -1.45, "LARM_JOINT3": -1.2})
    times = np.array([0.05, 0.75, 1.4])
    path = np.array([robot.half_sitting, up, robot.half_sitting])
    world.follow(moving(times, path), 0.0)
    log = run(world, 1.5)
    error = np.abs(log["q"][4::5] - log["tick_reference"])
    assert np.abs(log["dq"]).max() > 3.0
    assert error.max() < 5e-3
    assert np.degrees(world.fall.max_tilt) < 1.0


@pytest.mark.nightly("two seconds of simulated time")
def test_an_arm_whose_shoulder_axes_become_parallel_stays_calm(make_world, robot, moving) -> None:
    """The links between two parallel axes are very light, and gears on them very stiff."""
    world = make_world(gear_scale=2.0)
    aside = robot.posture({"RARM_JOINT1": -1.2, "RARM_JOINT0": -0.9})
    back = robot.posture({"RARM_JOINT1": -np.pi / 2.0, "RARM_JOINT2": 0.8})
    path = np.array([robot.half_sitting, aside, back])
    world.follow(moving(np.array([0.05, 0.9, 1.6]), path), 0.0)
    log = run(world, 2.0)
    assert not world.fell
    assert np.abs(log["q"][4::5] - log["tick_reference"]).max() < 0.05
    np.testing.assert_allclose(log["q"][-1], log["tick_reference"][-1], atol=0.02)


@pytest.mark.nightly("four seconds of simulated time")
def test_changing_the_step_near_the_leaf_does_not_jolt(make_world, sway, moving) -> None:
    """A change of the physics step near the leaf does not disturb the motion."""
    world = make_world(door_distance=0.5, sole="rigid")
    swaying(world, sway, moving, slower=1.8)  # slow: no sole lifts off
    log = run(world, 2.2)
    fine = log["tick_fine"]
    changes = np.flatnonzero(np.diff(fine.astype(int)))
    assert len(changes) >= 2
    coarse = make_world(door_distance=0.5, sole="rigid", time_step_fine=0.0005)
    swaying(coarse, sway, moving, slower=1.8)
    plain = run(coarse, 2.2)
    assert np.abs(log["com_position"] - plain["com_position"]).max() < 1e-3
    for change in changes:
        around = slice(5 * change - 5, 5 * change + 15)
        for key in ("b_velocity", "com_velocity"):
            assert np.abs(log[key][around] - plain[key][around]).max() < 0.01


def leaning_hit(robot, paper_door, sway, moving, **settings):
    """Sway onto the leaf with the braced arm; return the world and its log."""
    from hrp2_sim_bridge.world import World

    braced = robot.posture(robot.braced_posture)
    probe = World(robot, paper_door, 2.0, -0.42, posture=braced)
    elbow = -probe.engine.robot.contact_sphere().position[1] + robot.contact_radius
    probe.close()
    world = World(robot, paper_door, elbow + 0.02, -0.42, posture=braced, **settings)
    times = np.array([0.1, 0.6, 0.95, 1.15])
    path = np.array([sway(y, braced) for y in (0.0, 0.03, -0.03, -0.04)])
    world.follow(moving(times, path), 0.0)
    return world, run(world, 1.0)


@pytest.mark.parametrize("brace", [
    "contact", pytest.param("rigid", marks=pytest.mark.nightly("another brace"))])
def test_hit_of_the_robot_turns_the_door_by_its_impulse(
    robot, paper_door, sway, moving, brace
) -> None:
    """The angular momentum of the door is the impulse of the robot's hit."""
    world, log = leaning_hit(robot, paper_door, sway, moving, brace=brace)
    force = log["contact_force"]
    touched = np.flatnonzero(force > 5.0)
    assert len(touched)
    links = {str(log["link_names"][link]) for link in log["contact_link"][touched]}
    assert links == {robot.contact_link}
    first, last = touched[0], touched[0] + 40
    lever = log["contact_point"][first : last + 1, 0] + 0.42
    impulse = (force[first : last + 1] * lever).sum() * 0.001
    closer = paper_door.door().restoring_torque(0.0) * (last + 1 - first) * 0.001
    gained = paper_door.i_a * log["door_velocity"][last]
    assert gained == pytest.approx(impulse - closer, rel=0.01)
    assert (log["tick_peak_torque"] <= robot.effort_limit * (1.0 + 1e-6)).all()
    carried = np.abs(log["tick_pad_impulse"].sum(axis=0)).max()
    assert (carried > 0.1) if brace == "contact" else (carried == 0.0)
    assert log["tick_locked"].any() == (brace == "rigid")
    world.close()


def test_position_error_decays_with_the_servos_time_constant(make_world, robot) -> None:
    """A motor's position error decays to 1/e in D / P of its servo."""
    world = make_world()
    joint, data = robot.index("LARM_JOINT4"), robot.drives
    time = data.speed_gain[joint] / data.position_gain[joint]
    before = world.joints.drives.position[joint]
    world.joints.drives.position[joint] += 0.02
    for _ in range(round(time / 0.005)):
        world.step()
    left = world.joints.drives.position[joint] - before
    assert left == pytest.approx(0.02 * np.exp(-1.0), rel=0.05)


def test_logged_frames_are_of_the_same_instant_as_the_joints(make_world, robot, moving) -> None:
    """Point B agrees with base and joint angles of the same row to 20 um."""
    import pinocchio as pin

    world = make_world()
    swung = robot.posture({"RARM_JOINT0": -1.2, "RARM_JOINT3": -1.2})
    path = np.array([robot.half_sitting, swung])
    world.follow(moving(np.array([0.05, 0.7]), path), 0.0)
    log = run(world, 0.6)
    model = pin.buildModelFromUrdf(str(robot.urdf_path), pin.JointModelFreeFlyer())
    data = model.createData()
    columns = [model.joints[model.getJointId(name)].idx_q for name in robot.joint_names]
    assert np.linalg.norm(log["b_velocity"], axis=1).max() > 0.5
    for row in range(0, 600, 50):
        q = np.concatenate([log["base_position"][row], log["base_quaternion"][row], np.zeros(30)])
        q[columns] = log["q"][row]
        pin.framesForwardKinematics(model, data, q)
        place = data.oMf[model.getFrameId(robot.contact_link)].translation
        np.testing.assert_allclose(log["b_position"][row], place, atol=2e-5)
