import numpy as np
from hrp2_sim_bridge.log.recorder import Recorder
from hrp2_sim_bridge.ros.pacer import Pacer
from hypothesis import given
from hypothesis import strategies as st


@given(st.integers(16, 300), st.integers(0, 200), st.integers(1, 7))
def test_recorder_keeps_the_latest_rows_in_order_and_within_its_bound(most, ticks, each) -> None:
    """A recorder keeps the latest rows in order, at most as many as its bound."""
    recorder = Recorder({"n": ((), "f8"), "v": ((2,), "f4")}, most)
    rows = ticks * each
    for first in range(0, rows, each):
        row = np.arange(first, first + each)
        recorder.add(each, n=row, v=np.stack([row, -row], axis=1))
    data = recorder.arrays()
    assert len(recorder) == len(data["n"]) <= most
    assert len(data["n"]) >= min(rows, most // 2)
    np.testing.assert_array_equal(data["n"], np.arange(rows - len(recorder), rows))
    np.testing.assert_array_equal(data["v"][:, 1], -data["n"])


class Watch:
    """A clock whose time the test sets."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_pacer_waits_for_real_time() -> None:
    """A pacer waits until real time has reached simulated time."""
    watch = Watch()
    pacer = Pacer(2.0, watch)
    pacer.advance(0.1)
    assert abs(pacer.wait() - 0.05) < 1e-12
    watch.now = 0.06
    assert pacer.wait() == 0.0


def test_pacer_does_not_hurry_after_a_long_stop() -> None:
    """After a long stop a pacer does not make up for the lost time."""
    watch = Watch()
    pacer = Pacer(1.0, watch)
    watch.now = 100.0
    pacer.advance(0.005)
    for _ in range(41):
        pacer.advance(0.005)
    assert pacer.wait() > 0.0
