"""Tests of the plots, and of the history behind each."""

from collections.abc import Iterator

import numpy as np
import pytest
import viser
from door_impact_view.live.plots import SPAN, History, Plots
from door_impact_view.live.state import STALE, Body, Stamped, State
from hypothesis import given
from hypothesis import strategies as st

SQUARE = np.array([[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]])


@pytest.fixture
def plots() -> Iterator[Plots]:
    """Plots on a page of their own."""
    server = viser.ViserServer("127.0.0.1", 0, verbose=False)
    yield Plots(server.gui)
    server.stop()


def test_angle_and_margin_are_in_degrees_and_millimetres(plots: Plots) -> None:
    """Times count back from the newest sample."""
    for time in (1.0, 1.5, 3.0):
        plots.add(State(
            now=time, door_angle=Stamped(time, np.array([np.radians(10.0 * time)])),
            zmp=Stamped(time, np.array([0.0, 0.02 * time])), polygon=Stamped(time, SQUARE)))
    plots.send()
    t, angle = plots.shown["door angle [deg]"].handle.data
    np.testing.assert_allclose(t, [-2.0, -1.5, 0.0])
    np.testing.assert_allclose(angle, [10.0, 15.0, 30.0])
    np.testing.assert_allclose(plots.shown["ZMP margin [mm]"].handle.data[1], [80.0, 70.0, 40.0])


def test_noise_is_not_drawn_as_large_as_a_signal(plots: Plots) -> None:
    """The axis shows at least 20 deg, from 0, and grows with what is larger."""
    for time, angle, shown in ((1.0, 1e-4, (0.0, 20.0)), (2.0, -0.05, (-5.0, 20.0)),
                               (3.0, 0.5, (-5.0, 30.0))):
        plots.add(State(now=time, door_angle=Stamped(time, np.array([angle]))))
        plots.send()
        scales = plots.shown["door angle [deg]"].handle.scales
        assert scales is not None
        assert scales["y"]["range"] == shown


def test_a_sensor_that_is_silent_has_no_value(plots: Plots) -> None:
    """Its curve does not go on with the last value, and the other one goes on."""
    for time in (1.0, 1.0 + 1.1 * STALE):
        plots.add(State(now=time, forces={
            "l_sole": Stamped(1.0, np.array([0.0, 0.0, 200.0])),
            "r_sole": Stamped(time, np.array([0.0, 0.0, 300.0]))}))
    _, left, right = plots.shown["vertical force on the feet [N]"].history.curves()
    np.testing.assert_array_equal(left, [200.0, np.nan])
    np.testing.assert_array_equal(right, [300.0, 300.0])


def test_any_joint_reading_or_force_can_be_plotted_besides(plots: Plots) -> None:
    """One at a time."""
    state = State(
        robot=Body(joints={"knee": 0.5}), now=1.0, forces={"sole": Stamped(1.0, np.ones(3))},
        imu=Stamped(1.0, np.array([0.0, 0.0, np.pi, 0.0, 0.0, 9.8])))
    for name, values in (("knee [deg]", [np.degrees(0.5)]), ("force on sole [N]", [1.0] * 3),
                         ("IMU: angular velocity [deg/s]", [0.0, 0.0, 180.0])):
        plots.add(state)
        plots._choice.value = name
        plots.add(state)
        np.testing.assert_allclose(np.ravel(plots.shown[name].history.curves()), [0.0, *values])
        assert len(plots.shown) == 2  # the other one is that of the feet


# Stamps are whole nanoseconds; times nearer to each other need not differ after a subtraction.
STAMPS = st.integers(0, 100_000_000_000).map(lambda number: 1e-9 * number)


@given(st.lists(STAMPS, min_size=1, max_size=60))
def test_a_history_is_ordered_and_not_longer_than_its_span(times):
    """Whatever stamps come, also older ones: times increase to 0 and reach back to the span."""
    history = History()
    for time in times:
        history.add(time, 2.0 * time)
        shown, values = history.curves()
        assert shown[-1] == 0.0
        assert (np.diff(shown) > 0.0).all()
        assert shown[0] >= -SPAN
        assert values[-1] == pytest.approx(2.0 * time)
        np.testing.assert_allclose(values, 2.0 * (time + shown), atol=1e-9)
