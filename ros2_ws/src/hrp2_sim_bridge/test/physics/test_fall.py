import numpy as np
import pytest
from humanoid_motion.driver_interface import TrajectoryArrays
from robot_driver.errors import TrajectoryRefusedError


@pytest.fixture(scope="module")
def fallen(robot, paper_door, moving):
    """A robot one second after it fell over its toes: the world, and the log after the fall."""
    from hrp2_sim_bridge.world import World

    world = World(robot, paper_door, 0.9, -0.42)
    lean = robot.posture({"RLEG_JOINT4": -1.0, "LLEG_JOINT4": -1.0})
    path = np.array([robot.half_sitting, lean])
    world.follow(moving(np.array([0.05, 0.5]), path), 0.0)
    for _ in range(400):
        world.step()
        if world.fell:
            break
    begin = world.time
    for _ in range(200):
        world.step()
    log = world.log()
    yield world, {name: log[name][log["tick_time"] > begin + 0.2] for name in log if
                  name.startswith("tick_")}
    world.close()


def test_fall_is_noticed_and_named(fallen) -> None:
    """The reason names what touched the floor or how far the base tilted."""
    world, _ = fallen
    assert world.fell
    assert "tilted" in world.fall.reason or "on the floor" in world.fall.reason


def test_fallen_robot_does_not_fight_the_floor(fallen, robot) -> None:
    """After a fall no joint uses more than a tenth of its torque, braced or not."""
    _, log = fallen
    ratio = log["tick_peak_torque"].max(axis=0) / robot.effort_limit
    assert ratio.max() <= 0.1 + 1e-6
    assert ratio.max() > 0.05


def test_fallen_robot_holds_its_reference(fallen) -> None:
    """The present motion ends with the fall."""
    _, log = fallen
    np.testing.assert_array_equal(log["tick_reference"][-1], log["tick_reference"][-100])


def test_fallen_robot_refuses_to_move_but_takes_a_stop_and_a_reset(fallen, robot) -> None:
    """A fallen robot refuses a trajectory with the reason of the fall; after a reset it stands."""
    world, _ = fallen
    reason = world.fall.reason
    still = TrajectoryArrays(robot.joint_names, [1.0], [robot.half_sitting.tolist()])
    with pytest.raises(TrajectoryRefusedError, match="fallen") as error:
        world.follow(still, 0.0)
    assert error.value.value == reason
    world.follow(TrajectoryArrays((), (), ()), 0.0)
    world.reset()
    assert not world.fell
    world.follow(still, 0.0)
