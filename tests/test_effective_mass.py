"""The mass that the simulated robot shows at point B beside the one of its mass matrix."""

import numpy as np
import pytest
from door_impact_common.errors import SettingError
from door_impact_evaluation.studies.physics_study import effective_masses
from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.benches.pull_bench import pull_test
from hrp2_sim_bridge.settings import ENGINES
from humanoid_motion.robot_model import RobotModel
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import configured_placement, make_settings


@pytest.fixture(scope="module")
def masses() -> dict:
    door = load_door("paper")
    plan = plan_impact(
        PlanRequest(np.radians(25.0)), KnownDoor("paper", door.door(), door.leaf.width),
        RobotModel(load_robot_config()), make_settings(configured_placement()))
    return {row["braced"]: row for row in effective_masses(plan)["rows"]}


@pytest.mark.parametrize("braced", [True, False])
@pytest.mark.parametrize("engine", ENGINES)
def test_a_short_blow_shows_the_spatial_effective_mass_in_each_engine(
        masses: dict, engine: str, braced: bool) -> None:
    """With a locked arm and with a free one, to 1.5 %."""
    assert masses[braced][engine] == pytest.approx(masses[braced]["spatial"], rel=0.015)


def test_to_a_blow_that_is_over_before_the_gears_wind_up_a_free_arm_is_light(masses: dict) -> None:
    """It shows a tenth of the mass of a locked one."""
    assert masses[False]["spatial"] < 0.15 * masses[True]["spatial"]


def test_a_blow_shorter_than_a_step_is_an_error() -> None:
    robot = load_robot_config()
    with pytest.raises(SettingError, match="duration") as error:
        pull_test(robot, robot.half_sitting, locked=(), duration=1e-6)
    assert error.value.value == 1e-6
