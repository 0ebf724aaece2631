from dataclasses import replace

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from door_impact_common.errors import SettingError
from hrp2_description.robot import SIDES
from hrp2_sim_bridge.control.admittance import FARTHEST
from hrp2_sim_bridge.control.hand_compliance import HandCompliance
from hrp2_sim_bridge.physics.frames import rotation
from hrp2_sim_bridge.settings import TICK
from humanoid_motion.driver_interface import ImuSample, TickSample
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.spline import JointReference


class Bench:
    """A robot without physics whose hands feel given forces in the world."""

    def __init__(self, robot, posture=None, heading=0.0) -> None:
        self.robot, self.compliance = robot, HandCompliance(robot)
        self.model = RobotModel(robot)
        self.links = [robot.wrist_sensors[side].link for side in SIDES]
        self.posture = np.array(robot.half_sitting if posture is None else posture)
        self.start, self.time = self.posture, 0.0
        self.quaternion = np.array([0.0, 0.0, np.sin(0.5 * heading), np.cos(0.5 * heading)])
        self.turn = rotation(self.quaternion)

    def hands(self, posture):
        """Return the poses of the hands in base_link, (2, 4, 4)."""
        return np.array(self.model.poses_in_base(posture, self.links))

    def step(self, left=(0.0, 0.0, 0.0), right=(0.0, 0.0, 0.0)) -> np.ndarray:
        """Advance by a tick; return the posture at its end."""
        hands = [np.append(pose[:3, :3].T @ self.turn.T @ np.asarray(force), np.zeros(3))
                 for pose, force in zip(self.hands(self.posture), (left, right), strict=True)]
        foot = np.array([0.0, 0.0, 285.0, 0.0, 0.0, 0.0])
        imu = ImuSample(self.quaternion, np.zeros(3), np.array([0.0, 0.0, GRAVITY]))
        sample = TickSample(self.time, self.posture, np.zeros(30), np.zeros(30), foot, foot, imu,
                            (0,) * 5, *hands)
        rest = JointReference(self.start, np.zeros(30), np.zeros(30))
        self.compliance.update(sample, lambda _time: rest)
        self.time += TICK
        self.posture = self.start + self.compliance.offsets(np.array([self.time]))[0]
        return self.posture

    def moved(self) -> np.ndarray:
        """Return the ways of the hands in the world, (2, 3) [m]."""
        return (self.hands(self.posture) - self.hands(self.start))[:, :3, 3] @ self.turn.T


@pytest.fixture
def bench(robot):
    return Bench(robot)


@pytest.mark.parametrize("heading", [0.0, 1.2])
@pytest.mark.parametrize("force", [(8.0, 0.0, 0.0), (-4.0, 4.0, 6.0)])
def test_a_hand_yields_along_the_force_wherever_the_robot_heads(robot, force, heading) -> None:
    """It yields by force over stiffness to 1 mm; the other hand, legs and chest stay."""
    bench = Bench(robot, heading=heading)
    bench.compliance.comply("right", 200.0)
    for _ in range(1500):
        bench.step(right=force, left=(20.0, 0.0, 0.0))
    np.testing.assert_allclose(bench.moved()[1], np.array(force) / 200.0, atol=1e-3)
    changed = np.flatnonzero(bench.posture != bench.start)
    assert all(robot.joint_names[joint].startswith("RARM") for joint in changed)
    np.testing.assert_allclose(bench.compliance.displacement("right"), bench.moved()[1], atol=1e-3)


def test_both_hands_yield_at_once(bench) -> None:
    """Each hand yields to its own force, with its own stiffness."""
    for side, stiffness in zip(SIDES, (200.0, 400.0), strict=True):
        bench.compliance.comply(side, stiffness)
    for _ in range(1500):
        bench.step(left=(6.0, 0.0, 0.0), right=(0.0, 6.0, 0.0))
    np.testing.assert_allclose(
        bench.moved(), [[0.03, 0.0, 0.0], [0.0, 0.015, 0.0]], atol=1e-3)


@pytest.mark.parametrize("seed", range(3))
def test_ranges_and_speeds_of_the_joints_are_kept(robot, seed) -> None:
    """Near the limits, under 200 N in any direction, joints stay within them; then they return."""
    random = np.random.default_rng(seed)
    low, high = np.array(robot.lower), np.array(robot.upper)
    near = np.where(random.random(30) < 0.5, low, high) * 0.999
    bench = Bench(robot, np.clip(near, low, high))
    bench.compliance.comply("right", 200.0)
    before = bench.posture
    for _ in range(400):
        after = bench.step(right=200.0 * random.standard_normal(3))
        assert (after >= low - 1e-9).all()
        assert (after <= high + 1e-9).all()
        assert (np.abs(after - before) <= robot.velocity_limit * TICK).all()
        assert np.linalg.norm(bench.compliance.displacement("right")) <= FARTHEST + 1e-9
        before = after
    bench.compliance.comply("right")
    for _ in range(1000):
        after = bench.step()
        assert (np.abs(after - before) <= robot.velocity_limit * TICK).all()
        if not bench.compliance.displacement("right").any():
            assert np.abs(after - before).max() < 1e-3
        before = after
    np.testing.assert_array_equal(bench.posture, bench.start)
    assert not bench.compliance.active


@pytest.mark.parametrize("force", [50.0, -60.0])
def test_a_stretched_arm_neither_turns_wildly_nor_winds_up(robot, force) -> None:
    """Along its own length it moves by the displacement, which it follows to 30 mm."""
    bench = Bench(robot, robot.posture({"RARM_JOINT3": -0.02}))
    bench.compliance.comply("right", 200.0)
    for _ in range(600):
        bench.step(right=(0.0, 0.0, force))
        assert np.linalg.norm(bench.moved()[1]) < FARTHEST + 0.01
    left = bench.compliance.displacement("right") - bench.moved()[1]
    assert np.linalg.norm(left) < 0.03


def test_a_wrench_without_numbers_moves_nothing(bench) -> None:
    """The posture stays finite and still."""
    bench.compliance.comply("right", 200.0)
    for _ in range(100):
        before = bench.step(right=(5.0, 0.0, 0.0))
    for _ in range(20):
        after = bench.step(right=(np.nan, 0.0, 0.0))
    np.testing.assert_allclose(after, before, atol=2e-3)
    assert np.isfinite(bench.compliance.load).all()


@pytest.mark.parametrize(("order", "name", "limit"), [
    (("middle", 200.0), "side", "left or right"), (("right", 20.0), "stiffness", "50"),
    (("right", 200.0, 90.0), "damping", "100"), (("right", 200.0, 200.0, 60.0), "mass", "50"),
    (("right", np.nan), "stiffness", "finite"), (("right", -1.0, np.inf), "damping", "finite")])
def test_an_order_out_of_range_is_refused_as_a_whole(bench, order, name, limit) -> None:
    """The error has name, value and limit, and the hand stays stiff."""
    with pytest.raises(SettingError, match=limit) as refused:
        bench.compliance.comply(*order)
    assert name in refused.value.setting
    assert not bench.compliance.active


def test_a_robot_without_wrist_sensors_refuses(robot) -> None:
    """Its hands stay stiff."""
    compliance = HandCompliance(replace(robot, wrist_sensors=None))
    with pytest.raises(SettingError, match="none"):
        compliance.comply("right", 200.0)
    assert not compliance.active


def test_the_load_of_the_hands_is_their_force_and_its_moment(bench) -> None:
    """It counts at once, is smoothed afterwards, and ends when both hands are stiff."""
    force = np.array([0.0, 20.0, 0.0])
    bench.compliance.comply("left", 200.0)
    bench.step(right=force)
    moment = np.cross(bench.hands(bench.start)[1, :3, 3], force)
    np.testing.assert_allclose(bench.compliance.load, [*force, *moment], atol=1e-9)
    bench.step()
    assert bench.compliance.load[1] == pytest.approx(20.0, rel=0.1)
    bench.compliance.comply("left")
    for _ in range(200):
        bench.step()
    assert bench.compliance.load is None
