"""The mass that the simulated robot shows at point B beside the one of its mass matrix."""

import numpy as np
import pytest
from door_impact_evaluation.studies.physics_study import effective_masses
from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.settings import ENGINES
from humanoid_motion.robot_model import RobotModel
from impact_planner.hit.placement import configured_settings
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest


@pytest.fixture(scope="module")
def masses() -> dict:
    robot = RobotModel(load_robot_config())
    plan = plan_impact(PlanRequest(np.radians(25.0)), KnownDoor.configured(load_door("paper")),
                       robot, configured_settings(robot))
    return {row["braced"]: row for row in effective_masses(robot, plan)["rows"]}


@pytest.mark.parametrize("braced", [True, False])
@pytest.mark.parametrize("engine", ENGINES)
def test_a_short_blow_shows_the_spatial_effective_mass_in_each_engine(
        masses: dict, engine: str, braced: bool) -> None:
    """With a locked arm and with a free one, to 1.5 %."""
    assert masses[braced][engine] == pytest.approx(masses[braced]["spatial"], rel=0.015)


def test_to_a_blow_that_is_over_before_the_gears_wind_up_a_free_arm_is_light(masses: dict) -> None:
    """It shows a tenth of the mass of a locked one."""
    assert masses[False]["spatial"] < 0.15 * masses[True]["spatial"]
