"""The planner's simulated hit against the simulation, which is other code and the whole robot."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from door_impact_evaluation.run.rehearsal import rehearse
from hrp2_description.robot import load_robot_config
from simulated_hit import Figures, HitLoads, pair_of

NAMES = load_robot_config().joint_names
LOADED = 20.0  # torque of a gear above which its load is compared [N m]
# Share and torque [N m] by which loads of gears may differ; of the arms' gears 10 % and 2 N m.
# The stabilizer moves the legs in the simulation; the model has none. A speed of the elbow along
# the leaf of 10 mm/s, which no plan has, decides where the leaf's friction turns the trunk.
TOLERANCES = {"RLEG": (0.25, 13.0), "LLEG": (0.25, 13.0), "CHES": (0.28, 2.0)}
FAST = {"door": "size3", "run_up": "zmp_limited"}
CASES: list[dict[str, Any]] = [
    {"degrees": 15.0, "gear_scale": 0.5}, {"degrees": 35.0, "gear_scale": 2.0},
    {"degrees": 36.0}, {"degrees": 30.0, "gear_scale": 0.5, "pad_scale": 2.0},
    {"degrees": 24.0, "door": "size2"}, {"degrees": 15.0, **FAST, "pad_scale": 0.5},
]


def require_alike(real: Figures, model: Figures) -> None:
    """Checks that simulation and prediction agree."""
    assert model.omega == pytest.approx(real.omega, rel=0.03)
    assert model.mass == pytest.approx(real.mass, rel=0.05)
    assert model.v_post == pytest.approx(real.v_post, abs=0.02)
    assert model.restitution == pytest.approx(real.restitution, rel=0.08)
    assert model.peak == pytest.approx(real.peak, rel=0.05)
    assert model.pads == pytest.approx(real.pads, rel=0.05)
    assert model.duration == pytest.approx(real.duration, abs=2e-3)
    assert model.preload == pytest.approx(real.preload, rel=0.10)
    arm = [column for column, name in enumerate(NAMES) if name.startswith("RARM")]
    assert model.before[arm] == pytest.approx(real.before[arm], abs=2.0)
    for column in np.flatnonzero(np.abs(real.gear) > LOADED):
        most, least = TOLERANCES.get(NAMES[column][:4], (0.10, 2.0))
        assert abs(model.gear[column]) == pytest.approx(
            abs(real.gear[column]), rel=most, abs=least), NAMES[column]


@pytest.mark.nightly("the same for many hits")
@pytest.mark.parametrize("case", CASES, ids=str)
def test_the_model_predicts_hits_with_other_gears_pads_and_doors(
        tmp_path: Path, case: dict[str, Any]) -> None:
    """15 to 36 deg (the left knee allows no more), gears and pads half to twice as stiff."""
    scales = {name: value for name, value in case.items() if name.endswith("scale")}
    loads = HitLoads()
    run = rehearse(case["degrees"], tmp_path / "hit.npz", watch=loads, **case)
    require_alike(*pair_of(run, loads, **scales))
