import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from hrp2_sim_bridge.errors import TrajectoryRefusedError
from hrp2_sim_bridge.physics.frames import rotation
from humanoid_motion.driver_interface import TrajectoryArrays

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


@pytest.fixture(scope="module", params=["rubber", "rigid"])
def swayed(request, robot, paper_door, sway, moving):
    """The log of a fast sway from foot to foot."""
    from hrp2_sim_bridge.world import World

    world = World(robot, paper_door, 0.9, -0.42, sole=request.param)
    swaying(world, sway, moving)
    yield run(world, 1.4)
    world.close()


def test_wrenches_change_the_momentum_as_newton_says(swayed, robot) -> None:
    """The impulse of the computed wrenches is the change of the momentum."""
    force = np.zeros((len(swayed["time"]), 3))
    for side in ("left", "right"):
        for row, quaternion in enumerate(swayed[f"{side}_sole_quaternion"]):
            force[row] += rotation(quaternion) @ swayed[f"{side}_wrench"][row, :3]
    force[:, 2] -= robot.mass * GRAVITY
    impulse = np.cumsum(force[1:], axis=0) * 0.001
    momentum = robot.mass * (swayed["com_velocity"][1:] - swayed["com_velocity"][0])
    assert np.abs(momentum[:, 1]).max() > 10.0
    np.testing.assert_allclose(momentum, impulse, atol=0.15)


def test_logged_velocities_are_the_slopes_of_logged_positions(swayed) -> None:
    """The logged velocities are the derivatives of the logged positions."""
    for position, velocity in (
        ("com_position", "com_velocity"), ("b_position", "b_velocity"),
        ("base_position", "base_linear_velocity"),
    ):
        moved = swayed[position][-1] - swayed[position][0]
        integral = swayed[velocity][1:].sum(axis=0) * 0.001
        np.testing.assert_allclose(integral, moved, atol=3e-4)
        slope = np.gradient(swayed[position], 0.001, axis=0)[50:-50]
        # Sudden changes of the floor's forces show in a derivative over 2 ms.
        assert np.median(np.abs(slope - swayed[velocity][50:-50])) < 2e-3


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


@pytest.mark.parametrize("gear_scale", [1.0, 2.0])
def test_an_arm_whose_shoulder_axes_become_parallel_stays_calm(
    make_world, robot, moving, gear_scale
) -> None:
    """The links between two parallel axes are very light, and gears on them very stiff."""
    world = make_world(gear_scale=gear_scale)
    aside = robot.posture({"RARM_JOINT1": -1.2, "RARM_JOINT0": -0.9})
    back = robot.posture({"RARM_JOINT1": -np.pi / 2.0, "RARM_JOINT2": 0.8})
    path = np.array([robot.half_sitting, aside, back])
    world.follow(moving(np.array([0.05, 0.9, 1.6]), path), 0.0)
    log = run(world, 2.0)
    assert not world.fell
    assert np.abs(log["q"][4::5] - log["tick_reference"]).max() < 0.05
    np.testing.assert_allclose(log["q"][-1], log["tick_reference"][-1], atol=0.02)


def test_reset_brings_back_the_same_run_bit_for_bit(make_world, sway, moving) -> None:
    """On rigid soles runs after two resets are the same, bit for bit."""
    world = make_world(door_distance=0.47, sole="rigid")  # part of the run has fine steps
    logs = []
    for _ in range(2):
        world.reset()
        world.push_door(6.0, 0.2)
        swaying(world, sway, moving)
        logs.append(run(world, 0.85))
    assert set(logs[0]["tick_fine"]) == {True, False}
    for name, column in logs[0].items():
        np.testing.assert_array_equal(column, logs[1][name], err_msg=name)


def test_refused_trajectories_leave_the_motion_as_it_was(make_world, robot, sway, moving) -> None:
    """Refused trajectories do not change the motion."""
    logs = []
    for disturbed in (False, True):
        world = make_world()
        swaying(world, sway, moving)
        for tick in range(60):
            if disturbed and tick % 7 == 3:
                bad = robot.half_sitting + (9.0, float("nan"), 0.5)[tick % 3]
                message = TrajectoryArrays(robot.joint_names, [0.01], [bad.tolist()])
                with pytest.raises(TrajectoryRefusedError):
                    world.follow(message, 0.0)
            world.step()
        logs.append(world.log(with_com=False))
    for name, column in logs[0].items():
        np.testing.assert_array_equal(column, logs[1][name], err_msg=name)


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


def test_the_rigid_brace_locks_the_arm_only_near_the_leaf_in_the_braced_posture(
    make_world, robot
) -> None:
    """Elsewhere, in another posture or after a fall every joint is free."""
    braced = robot.posture(robot.braced_posture)
    joints = make_world(brace="rigid").joints
    step = 5e-4
    assert joints.begin_tick(braced, step, near=True, fell=False)
    assert not joints.begin_tick(braced, step, near=False, fell=False)
    assert not joints.begin_tick(braced, step, near=True, fell=True)
    braced[robot.index("RARM_JOINT1")] += np.radians(8.0)
    assert not joints.begin_tick(braced, step, near=True, fell=False)


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


@pytest.mark.parametrize("brace", ["contact", "rigid", "none"])
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


@pytest.mark.parametrize("step", [0.0005, 0.00025])
def test_position_error_decays_with_the_servos_time_constant(make_world, robot, step) -> None:
    """A motor's position error decays to 1/e in D / P of its servo, at any physics step."""
    world = make_world(time_step_coarse=step)
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




def test_log_is_saved_whole_and_can_be_read_back(make_world, tmp_path) -> None:
    """A log is saved completely and can be read again."""
    world = make_world()
    log = run(world, 0.05)
    path = world.save_log(tmp_path / "deep" / "run")
    with np.load(path) as data:
        assert set(data.files) == set(log)
        np.testing.assert_array_equal(data["time"], log["time"])
    assert [p.name for p in path.parent.iterdir()] == ["run.npz"]
