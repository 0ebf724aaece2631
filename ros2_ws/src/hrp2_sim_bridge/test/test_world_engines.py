"""The world in each physics engine: what holds whichever engine computes the motion."""

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from door_impact_common.errors import SettingError
from hrp2_description.robot import SIDES
from hrp2_sim_bridge.physics.frames import rotation
from hrp2_sim_bridge.settings import ENGINES, SensorSettings
from hrp2_sim_bridge.world import World

EXACT = SensorSettings(sensor_noise=False)


def run(world, seconds):
    """Step for a number of seconds; return the log."""
    for _ in range(round(seconds / 0.005)):
        world.step()
    return world.log()


@pytest.fixture(scope="module")
def sways(robot, paper_door, sway, moving):
    """The logs of a sway from foot to foot, with what the hands feel, by the engine."""
    logs = {}
    for engine in ENGINES:
        world = World(robot, paper_door, 0.9, -0.42, engine=engine, sensors=EXACT)
        postures = np.array([sway(y) for y in (0.0, 0.04, -0.04, 0.0)])
        world.follow(moving(np.array([0.1, 0.5, 0.9, 1.3]), postures), 0.0)
        hands = np.array([hands_of(world.step()) for _ in range(280)])
        logs[engine] = world.log() | {"hands": hands}
        assert not world.fell
        world.close()
    return logs


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("sole", ["rubber", "rigid"])
def test_the_robot_stands_on_its_weight_and_its_feet_do_not_creep(
    make_world, robot, engine, sole
) -> None:
    """The feet carry m g to 0.5 %, stay in place to 1 um in half a second, and sag on rubber.

    The engine's own contacts with the floor say the same as the force sensors.
    """
    world = make_world(engine=engine, sole=sole, sensors=EXACT)
    run(world, 0.5)
    log = run(world, 0.5)
    carried = log["left_wrench"][-500:, 2] + log["right_wrench"][-500:, 2]
    np.testing.assert_allclose(carried, robot.mass * GRAVITY, rtol=0.005)
    depths = []
    for side in SIDES:
        place = log[f"{side}_sole_position"]
        assert np.abs(place[-1, :2] - place[-500, :2]).max() < 1e-6
        depths.append(-place[-1, 2])
    contacts = world.engine.floor_contacts()
    assert {contact.link for contact in contacts} == {foot.sole for foot in robot.feet.values()}
    assert len(contacts) == 8
    force = sum(np.array(contact.force) for contact in contacts)
    assert force[2] == pytest.approx(robot.mass * GRAVITY, rel=0.01)
    # The contacts' moment about the world's origin is that of the sensors, to a millimetre.
    moment = sum(np.cross(contact.point, contact.force) for contact in contacts)
    measured = sum(
        log[f"{side}_wrench"][-1, 3:] + np.cross(
            log[f"{side}_sole_position"][-1], log[f"{side}_wrench"][-1, :3]) for side in SIDES)
    np.testing.assert_allclose(measured[:2], moment[:2], atol=1e-3 * force[2])
    wanted = robot.mass * GRAVITY / 2.0 / robot.sole_rubber.stiffness if sole == "rubber" else 0.0
    assert np.mean(depths) == pytest.approx(wanted, rel=0.02, abs=1e-4)


@pytest.mark.parametrize("engine", ENGINES)
def test_wrenches_change_the_momentum_as_newton_says(sways, robot, engine) -> None:
    """The impulse of the computed wrenches is the change of the momentum."""
    log = sways[engine]
    force = np.zeros((len(log["time"]), 3))
    for side in SIDES:
        turn = rotation(log[f"{side}_sole_quaternion"])
        force += (turn @ log[f"{side}_wrench"][:, :3, None])[..., 0]
    force[:, 2] -= robot.mass * GRAVITY
    impulse = np.cumsum(force[1:], axis=0) * 0.001
    momentum = robot.mass * (log["com_velocity"][1:] - log["com_velocity"][0])
    assert np.abs(momentum[:, 1]).max() > 10.0
    np.testing.assert_allclose(momentum, impulse, atol=0.15)


@pytest.mark.parametrize("engine", ENGINES)
def test_logged_velocities_are_the_slopes_of_logged_positions(sways, engine) -> None:
    """The logged velocities are the derivatives of the logged positions."""
    log = sways[engine]
    for position, velocity in (
        ("com_position", "com_velocity"), ("b_position", "b_velocity"),
        ("base_position", "base_linear_velocity"),
    ):
        moved = log[position][-1] - log[position][0]
        integral = log[velocity][1:].sum(axis=0) * 0.001
        np.testing.assert_allclose(integral, moved, atol=3e-4)
        slope = np.gradient(log[position], 0.001, axis=0)[50:-50]
        # Sudden changes of the floor's forces show in a derivative over 2 ms.
        assert np.median(np.abs(slope - log[velocity][50:-50])) < 2e-3


def test_two_engines_show_the_same_sway(sways) -> None:
    """On rubber the CoM's path differs by less than 1 mm, a foot's load by 3 % of m g.

    On rigid soles the robot rocks on edges, which multiplies every small difference.
    """
    logs = [sways[engine] for engine in ENGINES]
    first, second = (log["com_position"] for log in logs)
    assert np.ptp(first[:, 1]) > 0.05
    assert np.abs(first - second).max() < 1e-3
    loads = [log["left_wrench"][:, 2].reshape(-1, 50).mean(axis=1) for log in logs]
    assert np.abs(loads[0] - loads[1]).max() < 0.03 * 58.0 * GRAVITY


@pytest.mark.parametrize(("engine", "brace"), [
    *((engine, "contact") for engine in ENGINES),
    pytest.param("pybullet", "rigid", marks=pytest.mark.nightly("another brace"))])
def test_hit_of_the_robot_turns_the_door_by_its_impulse(
    robot, paper_door, sway, moving, engine, brace
) -> None:
    """The angular momentum that the door gains in a hit is that of the contact's forces.

    The motors stay within their torques, and pads or locks carry the arm.
    """
    braced = robot.posture(robot.braced_posture)
    places = []
    for distance in (2.0, None):
        world = World(
            robot, paper_door, distance or 0.02 + robot.contact_radius - places[0], -0.42,
            posture=braced, engine=engine, brace=brace)
        places.append(run(world, 0.005)["b_position"][-1, 1])
        if distance:
            world.close()
    path = np.array([sway(y, braced) for y in (0.0, 0.03, -0.03, -0.04)])
    world.follow(moving(np.array([0.1, 0.6, 0.95, 1.15]), path), 0.0)
    log = run(world, 1.0)
    world.close()
    force = log["contact_force"]
    touched = np.flatnonzero(force > 5.0)
    assert {str(log["link_names"][link]) for link in log["contact_link"][touched]} == {
        robot.contact_link}
    first, last = touched[0], touched[0] + 40
    lever = log["contact_point"][first : last + 1, 0] + 0.42
    impulse = (force[first : last + 1] * lever).sum() * 0.001
    closer = paper_door.door().restoring_torque(0.0) * (last + 1 - first) * 0.001
    gained = paper_door.i_a * log["door_velocity"][last]
    assert gained > 2.0
    assert gained == pytest.approx(impulse - closer, rel=0.01)
    assert (log["tick_peak_torque"] <= robot.effort_limit * (1.0 + 1e-6)).all()
    carried = np.abs(log["tick_pad_impulse"].sum(axis=0)).max()
    assert (carried > 0.1) if brace == "contact" else (carried == 0.0)
    assert log["tick_locked"].any() == (brace == "rigid")


def external_impulse(log, mass):
    """Return the change of the robot's momentum that the floor's forces do not explain [N s].

    The forces computed for the floor contain the share of the push on the soles themselves, 0.7 %.
    """
    floor = sum(
        (rotation(log[f"{side}_sole_quaternion"]) @ log[f"{side}_wrench"][:, :3, None])[1:, :, 0]
        for side in ("left", "right"))
    floor = floor.sum(axis=0) * 0.001
    floor[2] -= 9.81 * mass * (len(log["time"]) - 1) * 0.001
    return mass * (log["com_velocity"][-1] - log["com_velocity"][0]) - floor


@pytest.mark.parametrize("engine", ENGINES)
def test_the_robot_gains_the_impulse_of_a_push(make_world, robot, engine) -> None:
    """The robot's momentum grows by the impulse to 2 %, beside what its soles get from the floor.

    Without a push it gains nothing.
    """
    impulse = (-3.0, 5.0, -4.0)
    world = make_world(door_distance=2.0, engine=engine, sensors=EXACT)
    still = run(world, 0.1)
    assert np.abs(external_impulse(still, robot.mass)).max() < 0.03
    world.reset()
    world.push_robot(np.array(impulse))
    gained = external_impulse(run(world, 0.12), robot.mass)
    np.testing.assert_allclose(gained, impulse, atol=0.02 * np.linalg.norm(impulse))


def test_pushes_that_act_together_are_limited_together(make_world) -> None:
    """Three pushes of 90 N s are refused unless one is over; so is a duration of NaN."""
    world = make_world(sole="rigid")
    with pytest.raises(SettingError, match="duration"):
        world.push_robot(np.ones(3), np.nan)
    for _ in range(2):
        world.push_robot(np.array([0.0, 90.0, 0.0]), duration=0.004)
    with pytest.raises(SettingError, match="270 N s"):
        world.push_robot(np.array([0.0, 90.0, 0.0]))
    run(world, 0.005)
    world.push_robot(np.array([0.0, 90.0, 0.0]))


def hands_of(sample):
    """Return the wrenches of the left and the right hand, (2, 6)."""
    return np.array([sample.left_hand_wrench, sample.right_hand_wrench])


def push_hand(world, side, force):
    """Push the middle of a hand with a force in the world from the next step on [N]."""
    link = world.robot_config.wrist_sensors[side].link
    if world.engine.name == "mujoco":
        world.engine.data.xfrc_applied[world.engine.model.body(link).id, :3] = force
        return

    def push(engine):
        index = engine.link_names.index(link)
        place = engine.client.getLinkState(engine.body, index)[0]
        engine.client.applyExternalForce(
            engine.body, index, force, place, engine.client.WORLD_FRAME)

    world.observers.append(push)


@pytest.mark.parametrize("engine", ENGINES)
def test_hands_in_the_air_feel_nothing(sways, engine) -> None:
    """Weight and inertia of the hands are compensated to 0.1 N, at rest and in motion."""
    felt = sways[engine]["hands"]
    assert np.abs(felt[..., :3]).max() < 0.1
    assert np.abs(felt[..., 3:]).max() < 0.01


@pytest.mark.parametrize(("engine", "side"), [*zip(ENGINES, SIDES, strict=True)])
def test_a_hand_feels_the_force_on_it_in_its_own_axes(make_world, engine, side) -> None:
    """The hand's wrench, turned into the world, is the applied force to 0.1 N.

    The other hand feels nothing.
    """
    world = make_world(engine=engine, sensors=EXACT)
    force = np.array([4.0, -6.0, 8.0])
    push_hand(world, side, force)
    for _ in range(120):
        felt = hands_of(world.step())
    place = SIDES.index(side)
    turn = world.links.turn[len(SIDES) + place]
    assert np.abs(turn - np.eye(3)).max() > 0.2
    np.testing.assert_allclose(turn @ felt[place, :3], force, atol=0.1)
    assert np.abs(felt[place, 3:]).max() < 0.01
    assert np.abs(felt[1 - place]).max() < 0.1
