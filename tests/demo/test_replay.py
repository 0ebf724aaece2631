"""A run of the nodes, had again from the orders that its log keeps."""

import json
from typing import Any

import numpy as np
import pytest


@pytest.mark.nightly("the demonstration is simulated once more")
def test_the_demonstration_is_had_again_from_its_command_log_bit_for_bit(
        demo: Any, ros2: Any) -> None:
    """Pushes, motion, hit and hold, without a node."""
    assert demo.status == 0, demo.text
    path = demo.out / "simulation.npz"
    with np.load(path) as log:
        kinds = {order["kind"] for order in json.loads(str(log["commands"]))["orders"]}
        assert np.degrees(log["door_angle"].max()) > 20.0
    assert {"push", "trajectory"} <= kinds
    done = ros2("run", "hrp2_sim_bridge", "replay", str(path))
    assert done.status == 0, done.out + done.err
    assert "bit for bit" in done.out


def test_a_log_that_is_none_is_an_error_of_one_line(tmp_path: Any, ros2: Any) -> None:
    """A missing file, and one without orders."""
    other = tmp_path / "other.npz"
    np.savez(other, time=np.zeros(3))
    for path in (tmp_path / "none.npz", other):
        done = ros2("run", "hrp2_sim_bridge", "replay", str(path))
        assert done.status == 1
        assert "Traceback" not in done.err
        assert path.name in done.err
