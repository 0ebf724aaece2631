"""The map of requests that can be planned, and the command that writes it."""

import csv
import json
import math

import numpy as np
import pytest
from door_model.door.config import load_door
from humanoid_motion.errors import JointLimit, PostureUnreachable
from impact_planner.errors import AngleUnreachable, InvalidRequest, SpeedUnreachable
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import RUN_UPS
from impact_planner.tools import impact_map_cli
from impact_planner.tools.impact_map import (
    LIMITS,
    MapRange,
    csv_text,
    largest_angles,
    limit_of,
    map_cells,
    table,
)

ANGLES = (12.0, 20.0, 28.0, 36.0)
RESTITUTIONS = (0.0, 0.4, 0.6)


def known_door(name):
    """A configured door by its name."""
    config = load_door(name)
    return KnownDoor(config.name, config.door(), config.leaf.width)


@pytest.fixture(scope="module")
def over():
    """The ranges of a map with two doors."""
    return MapRange(
        (known_door("paper"), known_door("size3")), tuple(map(math.radians, ANGLES)), RESTITUTIONS,
        "retreat")


@pytest.fixture(scope="module")
def cells(robot, over):
    """The cells of that map."""
    return list(map_cells(over, robot))


def places(cells):
    """Cells by door, restitution and angle, then by run-up."""
    found = {}
    for cell in cells:
        found.setdefault((cell.door, cell.restitution, cell.angle), {})[cell.run_up] = cell
    return found


def test_every_request_is_there_once(over, cells):
    """The map has one cell for each door, angle, restitution and run-up."""
    assert len({(c.door, c.angle, c.restitution, c.run_up) for c in cells}) == len(over) == 48
    assert len(cells) == 48


def test_the_map_has_plans_and_refusals_of_both_run_ups(cells):
    """The map has plans and refusals of both run-ups, which the other tests need."""
    for run_up in RUN_UPS:
        assert {cell.feasible for cell in cells if cell.run_up == run_up} == {True, False}


def test_a_cell_is_what_the_planner_says(robot, over, cells):
    """A cell has v_rB, margins and step of the plan for its request."""
    cell = next(cell for cell in cells if cell.feasible)
    door = next(door for door in over.doors if door.name == cell.door)
    plan = plan_impact(
        PlanRequest(cell.angle, restitution=cell.restitution, run_up=cell.run_up, ending="retreat"),
        door, robot)
    assert (cell.v_rb, cell.step) == (plan.v_rb, plan.hit.stance.step)
    assert cell.cam_margin == plan.zmp_margins["cam"] >= cell.margin
    assert cell.margin == min(plan.zmp_margins.values())


def test_zmp_limited_is_feasible_wherever_mcv50_is(cells):
    """zmp_limited is feasible wherever mcv50 is, with at most 1 mm less margin."""
    for place, both in places(cells).items():
        if both["mcv50"].feasible:
            assert both["zmp_limited"].feasible, place
            assert both["zmp_limited"].cam_margin > both["mcv50"].cam_margin - 1e-3, place


def test_v_rb_rises_with_the_angle_and_falls_with_restitution(cells):
    """For one door, step and run-up, v_rB rises with the angle and falls with restitution."""
    plans = [cell for cell in cells if cell.feasible]
    pairs = 0
    for one in plans:
        for other in plans:
            if (one.door, one.run_up) != (other.door, other.run_up):
                continue
            if one.step != pytest.approx(other.step, abs=1e-3):
                continue
            if one.restitution == other.restitution and one.angle < other.angle:
                assert one.v_rb < other.v_rb
                pairs += 1
            if one.angle == other.angle and one.restitution < other.restitution:
                assert one.v_rb > other.v_rb
                pairs += 1
    assert pairs > 5


def test_a_plan_has_figures_and_a_refusal_has_reasons(cells):
    """A cell has either figures that keep the required margin, or reasons."""
    for cell in cells:
        figures = np.array([cell.v_rb, cell.cam_margin, cell.margin, cell.step])
        if cell.feasible:
            assert np.isfinite(figures).all()
            assert 0.02 <= cell.margin <= cell.cam_margin
            assert cell.limit == cell.quantity == cell.reason == ""
        else:
            assert np.isnan(figures).all()
            assert cell.limit in LIMITS
            assert cell.quantity
            assert cell.reason


@pytest.mark.parametrize(
    ("error", "limit"),
    [
        (SpeedUnreachable("too fast", quantity="v_rb [m/s]"), "run-up"),
        (SpeedUnreachable("pushed", quantity="pushed on [m]"), "pushes on"),
        (PostureUnreachable("no rest", phase="post", quantity="way to rest [m]"), "rest"),
        (PostureUnreachable("no rest", phase="post", quantity="ZMP margin [m]"), "rest"),
        (PostureUnreachable("near", phase="cam", quantity="ZMP margin [m]"), "run-up"),
        (PostureUnreachable("near", phase="back", quantity="ZMP margin [m]"), "balance"),
        (PostureUnreachable("near", phase="hold", quantity="clearance [m]"), "ending"),
        (PostureUnreachable("near", phase="post", quantity="clearance [m]"), "bodies"),
        (PostureUnreachable("slips", quantity="friction"), "grip"),
        (PostureUnreachable("slips", quantity="slip [m]"), "grip"),
        (PostureUnreachable("far", quantity="door_distance [m]"), "reach"),
        (JointLimit("fast", phase="cam", quantity="speed [rad/s]"), "joint"),
        (JointLimit("fast", phase="hold", quantity="speed [rad/s]"), "ending"),
        (AngleUnreachable("strong", phase="hold", quantity="hand force [N]", limit=60.0), "ending"),
        (AngleUnreachable("late", phase="hold", limit=(0.2, 1.0)), "ending"),
        (AngleUnreachable("too far", limit=2.0), "linkage"),
        (InvalidRequest("nonsense"), "request"),
    ],
)
def test_every_kind_of_refusal_has_its_name(error, limit):
    """Phase, reason and quantity of an error decide its limit, and no words do."""
    assert limit_of(error) == limit


def test_largest_angles_are_those_of_the_cells(cells):
    """The largest angle has the v_rB, gaps and next limit of its cells."""
    for one in largest_angles(cells):
        row = [cell for cell in cells if (cell.door, cell.restitution, cell.run_up)
               == (one.door, one.restitution, one.run_up)]
        good = [cell for cell in row if cell.feasible]
        if not good:
            assert math.isnan(one.angle)
            assert one.beyond == row[0].limit
            continue
        top = max(good, key=lambda cell: cell.angle)
        assert (one.angle, one.v_rb) == (top.angle, top.v_rb)
        between = [cell for cell in row if one.smallest <= cell.angle <= one.angle]
        assert one.gaps == len(between) - len(good)
        beyond = [cell.limit for cell in row if cell.angle > one.angle]
        assert one.beyond == (beyond[0] if beyond else "")


def test_table_has_a_row_for_each_door_and_restitution(cells):
    """The table has a row for each door and restitution, with equal numbers of columns."""
    lines = table(cells).splitlines()
    assert len(lines) == 2 + 2 * len(RESTITUTIONS)
    assert len({line.count("|") for line in lines}) == 1


def test_csv_reads_back(cells):
    """The CSV has degrees and millimetres, and empty figures for refusals."""
    rows = list(csv.DictReader(csv_text(cells).splitlines()))
    assert len(rows) == len(cells)
    for row, cell in zip(rows, cells, strict=True):
        assert float(row["angle_deg"]) == pytest.approx(math.degrees(cell.angle), rel=1e-5)
        assert (row["v_rb_m_s"] != "") is (row["code"] == "") is cell.feasible
        if cell.feasible:
            assert float(row["margin_mm"]) == pytest.approx(1e3 * cell.margin, rel=1e-5)


def run(tmp_path, *more):
    """Run the command on a tiny map."""
    return impact_map_cli.main([
        "--doors", "paper", "--angles", "25", "15", "25", "--restitutions", "0.5",
        "--ending", "retreat", "--out", str(tmp_path / "map"), *more])


def test_the_command_writes_what_it_says(tmp_path, capsys):
    """The command prints a table and writes picture and CSV with sorted, unique angles."""
    assert run(tmp_path) == 0
    out = capsys.readouterr().out
    assert "| paper | 0.5 | 15 to 25 |" in out
    assert "4 of 4 requests can be planned" in out
    for name in ("impact_map.csv", "impact_map.png"):
        assert str(tmp_path / "map" / name) in out
    assert (tmp_path / "map" / "impact_map.png").read_bytes().startswith(b"\x89PNG")
    rows = list(csv.DictReader((tmp_path / "map" / "impact_map.csv").read_text().splitlines()))
    assert [(row["run_up"], float(row["angle_deg"])) for row in rows] == [
        (run_up, angle) for run_up in RUN_UPS for angle in (15.0, 25.0)]


def test_json_has_every_request(tmp_path, capsys):
    """--json prints one object with every request and without NaN."""
    assert run(tmp_path, "--angles", "20", "170", "--json") == 0
    found = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert [cell["feasible"] for cell in found["cells"]] == [True, False, True, False]
    assert all(cell["reason"] for cell in found["cells"] if not cell["feasible"])


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--angles", "nan"], "angles must be above 0"),
        (["--angles", "0"], "angles must be above 0"),
        (["--angles=-5"], "not -5"),
        (["--angles", "200"], "at most 180 deg"),
        (["--restitutions", "1.5"], "restitutions must be from 0 to 1"),
        (["--restitutions", "nan"], "restitutions"),
        (["--doors", "garage"], "garage"),
        (["--doors", "nowhere.yaml"], "nowhere.yaml"),
        (["--out", "/proc/no/folder"], "cannot be made"),
    ],
)
def test_bad_options_are_one_line_on_stderr_and_status_1(capsys, tmp_path, arguments, reason):
    """A bad option prints one line on stderr, before any planning, and nothing on stdout."""
    assert run(tmp_path, *arguments) == 1
    found = capsys.readouterr()
    assert found.out == ""
    assert reason in found.err
    assert found.err.count("\n") == 1


def test_two_doors_of_one_name_are_refused(tmp_path, capsys):
    """Two doors with one name are refused, because their rows could not be told apart."""
    path = tmp_path / "mine.yaml"
    path.write_text(load_door("paper").to_yaml())
    assert run(tmp_path, "--doors", "paper", str(path)) == 1
    assert "two doors are called 'paper'" in capsys.readouterr().err
