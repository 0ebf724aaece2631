"""The planner's parameters, and the commands `plan` and `find_posture`."""

import json
import math

import numpy as np
import pytest
from door_impact_common.yaml_files import read_yaml, yaml_text
from door_model.door.config import load_door
from hrp2_description.data import data_path
from hrp2_description.robot import load_robot_config
from humanoid_motion.robot_model import RobotModel
from impact_planner.errors import InvalidRequest
from impact_planner.hit import placement
from impact_planner.task.experience import Limits
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest, resolve
from impact_planner.task.settings import make_settings, parameters_of
from impact_planner.tools import plan_cli, posture_cli

ROBOT = RobotModel(load_robot_config())


@pytest.fixture(autouse=True)
def nominal_placement(monkeypatch):
    """Use the door's nominal place, whatever parameter file is installed."""
    monkeypatch.setattr(placement, "_surveyed", dict)


def test_own_choice_is_said_by_a_negative_length_or_nan():
    """A negative length or NaN leaves the choice to the planner; integers are accepted."""
    chosen = make_settings({"door_distance": 1, "hinge_x": -1, "effective_mass": 50}, ROBOT)
    assert (chosen.door_distance, chosen.hinge_x, chosen.effective_mass) == (1.0, -1.0, 50.0)
    own = make_settings({"door_distance": -1.0, "hinge_x": math.nan, "effective_mass": -1.0}, ROBOT)
    assert (own.door_distance, own.hinge_x, own.effective_mass) == (None, None, None)


@pytest.mark.parametrize(("name", "bad"), [
    *((name, math.inf) for name in parameters_of(ROBOT)), ("restitution", True),
    ("restitution", 1.5),
    ("run_up", "sprint"), ("post_duration", 0.0)])
def test_a_parameter_of_the_wrong_kind_or_out_of_range_is_named(name, bad):
    with pytest.raises(InvalidRequest, match=name):
        make_settings({name: bad}, ROBOT)


@pytest.mark.parametrize(("angle", "words"), [
    (25.0, "is 25 rad, which is 1432 deg, must be at most 3.142 rad; 25 deg would be 0.4363 rad"),
    (math.radians(200.0), "is 3.491 rad, which is 200 deg, must be at most 3.142 rad"),
    (1e4, "is 1e+04 rad, which is 572958 deg, must be at most 3.142 rad")])
def test_an_angle_in_degrees_is_told_from_one_that_is_too_large(angle, words):
    known = KnownDoor.configured(load_door("paper"))
    with pytest.raises(InvalidRequest) as refused:
        resolve(PlanRequest(angle), make_settings({}, ROBOT), known)
    assert str(refused.value) == f"desired_opening_angle {words}"


def test_limits_of_learning_are_parameters():
    """Defaults are 0.3 to 0.7 and 0.7 to 1.25; the configured restitution is always inside."""
    assert make_settings({}, ROBOT).learning_limits == Limits((0.7, 1.25), (0.3, 0.7))
    found = make_settings(
        {"restitution": 0.1, "largest_restitution": 0.6, "least_mass_factor": 0.4}, ROBOT)
    assert found.learning_limits == Limits((0.4, 1.25), (0.1, 0.6))
    with pytest.raises(InvalidRequest, match="least_restitution at most"):
        make_settings({"least_restitution": 0.6, "largest_restitution": 0.5}, ROBOT)


def test_json_has_the_keys_that_scripts_read(tmp_path, capsys):
    """Also for a door from a file that `identify --yaml` writes."""
    path = tmp_path / "mine.yaml"
    path.write_text(load_door("paper").to_yaml().replace("name: paper", "name: mine"))
    assert plan_cli.main(["--angle-deg", "25", "--door", str(path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    keys = {"omega_door", "v_rb", "v_rb_post", "effective_mass", "effective_mass_planar", "a_r",
            "b_r", "i_rob", "l_b", "planning_ms"}  # fmt: skip
    assert keys <= set(found)
    assert all(np.isfinite(found[key]) for key in keys)
    assert found["omega_door"] == pytest.approx(0.635, abs=1e-3)
    assert found["door"] == "mine"


def test_a_found_posture_hits_as_well_as_the_shipped_one_and_its_lines_plan_so(tmp_path, capsys):
    """From a file with another contact body, a hanging arm, and the trunk's pad elsewhere."""
    path, file = tmp_path / "mine.yaml", read_yaml(data_path("config/robot.yaml"))
    arm = dict(zip(file["braced_posture_deg"], file["half_sitting_deg"]["RARM"], strict=True))
    file |= {"contact_link": "r_gripper", "contact_radius": 0.02, "braced_posture_deg": arm}
    file["brace"]["trunk"]["xyz"] = [0.0, 0.0, 0.0]
    path.write_text(yaml_text(file))
    assert posture_cli.main([str(path)]) == 0
    title, fields = capsys.readouterr().out.split("# v_rB ")[1].split("\n", 1)
    path.with_name("found.yaml").write_text(fields)
    path.write_text(yaml_text(file | read_yaml(path.with_name("found.yaml"))))
    found, shipped = (
        (plan_cli.main(["--angle-deg", "25", "--ending", "retreat", "--run-up", "zmp_limited",
                        "--json", "--robot", str(robot)]), json.loads(capsys.readouterr().out))[1]
        for robot in (path, data_path("config/robot.yaml")))
    assert title.startswith(f"{found['v_rb']:.3f} m/s, m_re {found['effective_mass']:.1f} kg")
    assert found["v_rb"] < 1.05 * shipped["v_rb"]
    assert found["effective_mass"] > 0.95 * shipped["effective_mass"]
    assert found["warnings"] == []


@pytest.mark.parametrize(("command", "arguments", "reason"), [
    (plan_cli, ["--angle-deg", "70"], "mcv50 reaches"),
    (plan_cli, ["--angle-deg", "25", "--door", "nowhere.yaml"], "nowhere.yaml"),
    (posture_cli, ["--angle-deg", "200"], "200 deg, must be at most")])
def test_a_failure_is_one_line_on_stderr_and_status_1(capsys, command, arguments, reason):
    assert command.main(arguments) == 1
    found = capsys.readouterr()
    assert found.out == ""
    assert reason in found.err
    assert found.err.count("\n") == 1
