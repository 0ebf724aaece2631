"""The comparison of what could hit the leaf."""

import json
from math import radians

import pytest
from impact_planner.errors import InvalidRequest
from impact_planner.task.settings import PlannerSettings
from impact_planner.tools.hit_bodies import bodies, compare, main

ELBOW, FREE, HIP = 0, 3, 4  # rows of the comparison below


@pytest.fixture(scope="module")
def hits(robot, known):
    over = bodies(robot.config, (0.44, 0.60), ("RLEG_LINK1",))
    return list(compare(over, known, PlannerSettings(), radians(25.0)))


def test_every_body_gives_the_leaf_the_same_momentum(hits):
    """Impulse times lever is I_A w' and what the closer takes, whatever hits."""
    for hit in hits:
        if hit.transfer is not None:
            speeds, response = hit.transfer.speeds, hit.transfer.response
            assert 0.42 * speeds.impulse - hit.transfer.braking == pytest.approx(
                12.75 * 0.635, rel=1e-3)
            assert response.omega == pytest.approx(0.635, rel=0.10)


def test_the_brace_spares_the_gears(hits):
    """Without pads some gear bears more than twice the share that any bears with them."""
    braced, free = (hits[row].transfer.loads[0].share for row in (ELBOW, FREE))
    assert free > 2.0 * braced


def test_a_lower_body_is_heavier_and_slower(hits):
    """The hip is nearer to the centre of mass than the elbow: more mass, less speed."""
    elbow, hip = (hits[row].transfer for row in (ELBOW, HIP))
    assert hip.mass > 1.5 * elbow.mass
    assert hip.speeds.v_rb < elbow.speeds.v_rb


def test_a_posture_out_of_reach_is_a_row_with_its_reason(hits):
    """An elbow 0.6 m from the middle is refused, the other rows stand."""
    refused = [hit for hit in hits if hit.transfer is None]
    assert [hit.name for hit in refused] == ["elbow at 0.600 m"]
    assert "cannot lean on the trunk" in refused[0].refusal


def test_an_unknown_link_is_refused_before_anything_is_computed(robot):
    """The message names the link."""
    with pytest.raises(InvalidRequest, match="no link 'ELBOW'"):
        next(bodies(robot.config, (), ("ELBOW",)))


def test_the_command_prints_a_row_for_each_body_or_json(capsys):
    """Table and JSON have the same bodies, and a refusal is a sentence and exit status 1."""
    chosen = ["--distances", "0.60", "--links", "RARM_LINK1"]
    assert main(chosen) == 0
    rows = capsys.readouterr().out.splitlines()[2:]
    assert main([*chosen, "--json"]) == 0
    hits = json.loads(capsys.readouterr().out)["hits"]
    assert [row.split(" | ")[0][2:] for row in rows] == [hit["body"] for hit in hits]
    assert main(["--angle-deg", "nan"]) == 1
    assert capsys.readouterr().err.startswith("hit_bodies: desired_opening_angle")
