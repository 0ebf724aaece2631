from dataclasses import replace

import numpy as np
import pytest
from humanoid_motion.driver_interface import TrajectoryArrays
from hypothesis import given
from hypothesis import strategies as st
from robot_driver.errors import TrajectoryRefusedError
from robot_driver.trajectory_checks import JointLimits
from robot_driver.trajectory_driver import TrajectoryDriver

NAMES = ("a", "b", "c")
LIMITS = JointLimits(NAMES, np.full(3, -1.0), np.full(3, 1.0), np.array([2.0, 4.0, 3.0]))


def driver() -> TrajectoryDriver:
    """Return a driver of three joints at rest."""
    return TrajectoryDriver(LIMITS, np.zeros(3))


def message(times, positions, velocities=(), accelerations=(), names=NAMES) -> TrajectoryArrays:
    """Return a trajectory for the three joints."""
    return TrajectoryArrays(names, times, positions, velocities, accelerations)


GOOD = message(
    [0.5, 1.0], [[0.1, 0.2, -0.1], [0.2, 0.1, -0.3]], [[0.1] * 3, [0.0] * 3], [[0.0] * 3] * 2)
NAN = float("nan")


def test_trajectory_without_a_stamp_starts_now_and_holds_its_last_point() -> None:
    """A trajectory with stamp 0 starts now from the reference and holds its last point."""
    d = driver()
    d.accept(GOOD, 0.0, 3.0)
    assert not d.sample(3.0).position.any()
    np.testing.assert_allclose(d.sample(3.5).position, [0.1, 0.2, -0.1], atol=1e-12)
    np.testing.assert_allclose(d.sample(99.0).position, [0.2, 0.1, -0.3], atol=1e-12)
    assert not d.sample(99.0).velocity.any()


@pytest.mark.parametrize(
    ("bad", "joint", "words"),
    [
        (replace(GOOD, joint_names=("a", "b", "x")), "x", "unknown"),
        (replace(GOOD, joint_names=("a", "b")), "c", "missing"),
        (replace(GOOD, times=[0.5, NAN]), "", "finite"),
        (replace(GOOD, times=[0.5, 0.5]), "", "increase"),
        (replace(GOOD, positions=[[0.0, 0.0], [0.0, 0.0, 0.0]]), "", "values"),
        (replace(GOOD, velocities=()), "", "without velocities"),
        (replace(GOOD, positions=[[0.1, NAN, 0.0], [0.0] * 3]), "b", "finite"),
        (replace(GOOD, positions=[[0.1, 0.2, -0.1], [0.2, 1.01, -0.3]]), "b", "above"),
        (replace(GOOD, velocities=[[2.1, 0.0, 0.0], [0.0] * 3]), "a", "speed"),
        (message([0.1], [[0.3, 0.0, 0.0]]), "a", "jump"),
        # The braking after a last point with a velocity or an acceleration is part of the motion.
        (message([3.0], [[1.0, 0.0, 0.0]], [[1.9, 0.0, 0.0]]), "a", "above"),
        # Outside the limits only for a short part of a long segment.
        (message([0.6, 5.58], [[0.0, 0.0, 0.0], [-0.67, 0.0, 0.0]], [[0.0] * 3, [1.9, 0.0, 0.0]],
                 [[0.0] * 3, [13.0, 0.0, 0.0]]), "a", ""),
        # Inside the limits at both points, outside between them.
        (message([1.0, 2.0], [[0.9, 0.0, 0.0]] * 2, [[1.9, 0, 0], [-1.9, 0, 0]]), "a", "above")])
def test_bad_trajectory_is_refused_and_changes_nothing(bad, joint, words) -> None:
    """A bad trajectory is refused with the joint and a reason, and changes nothing."""
    d = driver()
    d.accept(GOOD, 0.0, 0.0)
    before = [d.sample(t).position.copy() for t in np.linspace(0.3, 1.2, 20)]
    with pytest.raises(TrajectoryRefusedError) as refused:
        d.accept(bad, 0.0, 0.3)
    assert refused.value.joint == joint
    assert words in str(refused.value)
    after = [d.sample(t).position for t in np.linspace(0.3, 1.2, 20)]
    np.testing.assert_array_equal(before, after)


def test_stamp_of_another_clock_is_refused_with_a_hint() -> None:
    """A stamp years ahead, NaN, or of a motion that is over is refused; a minute ahead is not."""
    d = driver()
    for stamp, words in ((1.8e9, "use_sim_time"), (NAN, "finite"), (1.0, "ended")):
        with pytest.raises(TrajectoryRefusedError, match=words):
            d.accept(GOOD, stamp, 12.0)
    assert not d.is_moving(12.0)
    d.accept(GOOD, 70.0, 12.0)
    assert d.is_moving(12.0)


@given(st.lists(st.floats(-1.0, 3.0), min_size=1, max_size=30))
def test_many_positions_at_once_are_those_one_by_one(times) -> None:
    """positions() agrees with sample() across replaced and waiting trajectories."""
    d = driver()
    d.accept(GOOD, 0.0, 0.0)
    d.accept(message([0.5], [[-0.2, 0.0, 0.0]], [[0.0] * 3], [[0.0] * 3]), 0.7, 0.2)
    rising = np.sort(times)
    np.testing.assert_allclose(
        d.positions(rising), [d.sample(time).position for time in rising], atol=1e-12)


def test_late_trajectory_is_followed_from_its_next_point_without_a_jump() -> None:
    """A late trajectory is joined from the reference, and is on its way at its next point."""
    d = driver()
    times = np.arange(0.0, 1.01, 0.1)
    ramp = np.outer(0.25 * times**2, [1.0, 1.0, 1.0])
    d.accept(message(times.tolist(), ramp.tolist(), np.outer(0.5 * times, [1] * 3).tolist()),
             1.0, 1.008)
    assert d.sample(1.008).position[0] == 0.0
    assert d.sample(1.1).position[0] == pytest.approx(0.25 * 0.1**2)
    assert d.sample(1.6).position[0] == pytest.approx(0.25 * 0.6**2)


@given(st.floats(0.01, 1.2), st.floats(0.5, 1.5))
def test_replacement_is_continuous_up_to_acceleration(when, duration) -> None:
    """A replaced motion is continuous up to the acceleration."""
    d = driver()
    d.accept(GOOD, 0.0, 0.0)
    before = d.sample(when)
    target = np.array([-0.05, 0.0, 0.1])
    new = message([duration], [target.tolist()], [[0.0] * 3], [[0.0] * 3])
    d.accept(new, 0.0, when)
    after = d.sample(when)
    np.testing.assert_allclose(after.position, before.position, atol=1e-12)
    np.testing.assert_allclose(after.velocity, before.velocity, atol=1e-9)
    np.testing.assert_allclose(after.acceleration, before.acceleration, atol=1e-6)
    np.testing.assert_allclose(d.sample(when + duration + 1.0).position, target, atol=1e-9)


@given(st.floats(0.0, 1.5))
def test_stop_brakes_smoothly_and_holds_within_limits(when) -> None:
    """A stop brakes smoothly, holds, and respects the limits."""
    d = driver()
    d.accept(GOOD, 0.0, 0.0)
    before = d.sample(when)
    d.accept(message([], []), 0.0, when)
    after = d.sample(when)
    np.testing.assert_allclose(after.position, before.position, atol=1e-12)
    np.testing.assert_allclose(after.velocity, before.velocity, atol=1e-9)
    rest = d.sample(when + 0.2)
    assert not rest.velocity.any()
    np.testing.assert_array_equal(rest.position, d.sample(when + 50.0).position)
    path = np.array([d.sample(when + t).velocity for t in np.linspace(0.0, 0.2, 60)])
    assert (np.abs(path) <= LIMITS.velocity * 1.1).all()


@given(st.floats(0.0, 0.1))
def test_stop_on_the_way_to_a_limit_stays_within_it(when) -> None:
    """A fast motion towards a limit can be stopped anywhere without exceeding the limit."""
    d = driver()
    d.reset(np.array([0.9, 0.0, 0.0]))
    d.accept(message([0.1], [[1.0, 0.0, 0.0]], [[0.0] * 3], [[0.0] * 3]), 0.0, 0.0)
    d.stop(when)
    path = d.positions(np.linspace(when, when + 0.3, 400))
    assert path[:, 0].max() < 1.0 + 0.006


@pytest.mark.parametrize("tick", [3, 84, 1663])
def test_motion_goes_on_at_the_very_tick_at_which_a_waiting_trajectory_begins(tick) -> None:
    """A waiting trajectory starts in its tick even if its stamp is rounded to a later time."""
    d = driver()
    stamp = round(tick * 5_000_000 // 10**9) + (tick * 5_000_000 % 10**9) * 1e-9
    d.accept(message([stamp + 1.0], [[0.2, 0.0, 0.0]], [[0.4, 0.0, 0.0]]), 0.0, 0.0)
    before = d.sample(tick * 0.005).velocity[0]
    d.accept(message([1.5], [[0.1, 0.0, 0.0]], [[0.0] * 3], [[0.0] * 3]), stamp, 0.0)
    assert d.sample(tick * 0.005).velocity[0] == pytest.approx(before, abs=1e-6)
    times = np.array([tick * 0.005])
    np.testing.assert_allclose(d.positions(times)[0], d.sample(times[0]).position, atol=1e-12)


def test_last_point_that_still_moves_is_followed_by_a_brake_not_a_jolt() -> None:
    """A last point with a velocity is followed by a smooth braking."""
    d = driver()
    d.accept(message([1.0], [[0.5, 0.0, 0.0]], [[1.0, 0.0, 0.0]]), 0.0, 0.0)
    speed = np.array([d.sample(t).velocity[0] for t in np.arange(0.9, 1.3, 0.001)])
    assert np.abs(np.diff(speed)).max() < 0.03
    assert speed[-1] == 0.0
    assert d.sample(9.0).position[0] > 0.5


def test_stop_drops_what_waits() -> None:
    """A stop discards a waiting trajectory."""
    d = driver()
    d.accept(message([0.5], [[0.3, 0.0, 0.0]]), 1.0, 0.0)
    d.stop(0.5)
    assert not d.sample(5.0).position.any()
