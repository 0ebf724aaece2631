import numpy as np
import pytest
from hrp2_sim_bridge.control.servo import Servo
from hrp2_sim_bridge.settings import TICK
from robot_driver.trajectory_checks import JointLimits

LIMITS = JointLimits(("a",), np.full(1, -1.0), np.full(1, 1.0), np.full(1, 2.0))


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_commands_are_played_back_in_their_order_so_many_periods_late(delay: int) -> None:
    """The joint moves evenly from each to the next; one that is no number moves nothing."""
    servo, found = Servo(LIMITS, np.zeros(1), delay), []
    for period, command in enumerate([0.1, 0.3, np.nan, 2.0, 0.5, 0.5, 0.5, 0.5, 0.5], 1):
        servo.command(np.array([command]))
        rows = servo.positions(period * TICK + TICK * np.array([0.0, 0.5, 1.0]))[:, 0]
        assert rows[1] == pytest.approx((rows[0] + rows[2]) / 2.0)
        assert servo.sample(period * TICK).velocity[0] * TICK == pytest.approx(rows[2] - rows[0])
        found.append(rows[2])
    assert found == pytest.approx(([0.0] * delay + [0.1, 0.3, 0.3, 1.0] + [0.5] * 5)[:9])
