"""Tests of the completed table of links and joints."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from hrp2_description.data import data_path
from hrp2_description.errors import ModelTableError
from hrp2_description.model_table import Inertial, load_model_table
from hypothesis import given
from hypothesis import strategies as st

TABLE = load_model_table()
LEFT = {"RLEG": "LLEG", "RARM": "LARM", "r_": "l_"}
SIDES = [
    (link.name, left + link.name[len(right) :])
    for link in TABLE.links
    for right, left in LEFT.items()
    if link.name.startswith(right)
]


def _edited_table(folder: Path, edit) -> Path:
    data = yaml.safe_load(data_path("config/hrp2_links.yaml").read_text(encoding="utf-8"))
    edit(data)
    path = folder / "links.yaml"
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    return path


def test_mass_is_58_kg():
    """The masses of the links add up to the manufacturer's figure."""
    assert TABLE.mass == pytest.approx(58.0, abs=1e-9)


def test_only_the_trunk_takes_the_remainder():
    """Every other link keeps its published mass, and the trunk gains less than 2 kg."""
    published = yaml.safe_load(data_path("config/hrp2_links.yaml").read_text())["links"]
    for name, row in published.items():
        gain = TABLE.link(name).inertial.mass - row["mass"]
        expected = {"base_link": 1.96, "r_ankle": -0.2}.get(name, 0.0)
        assert gain == pytest.approx(expected, abs=0.01), name


def test_inertia_belongs_to_a_real_body():
    """Principal moments are positive and obey the triangle inequality with a margin."""
    for link in TABLE.links:
        a, b, c = link.inertial.principal_moments()
        assert a > 0.0, link.name
        assert a + b > c * 1.0001, link.name


def test_left_is_the_mirror_of_right():
    """Mass, CoM and inertia are those of the other side, reflected in the plane y = 0."""
    flip = np.diag([1.0, -1.0, 1.0])
    for right, left in SIDES:
        one, other = TABLE.link(right).inertial, TABLE.link(left).inertial
        assert one.mass == other.mass
        np.testing.assert_allclose(flip @ one.com, other.com, err_msg=right)
        np.testing.assert_allclose(flip @ one.inertia @ flip, other.inertia, err_msg=right)


def test_foot_keeps_its_inertia_when_the_sole_is_split_off():
    """Ankle link and sole together have mass, CoM and inertia of the published foot."""
    row = yaml.safe_load(data_path("config/hrp2_links.yaml").read_text())["links"]["r_ankle"]
    ankle, sole = TABLE.link("r_ankle").inertial, TABLE.link("r_sole").inertial
    offset = np.array([0.0, 0.0, -0.105])
    mass = ankle.mass + sole.mass
    com = (ankle.mass * ankle.com + sole.mass * offset) / mass
    inertia = np.zeros((3, 3))
    for part, place in ((ankle, ankle.com), (sole, offset)):
        arm = place - com
        inertia += part.inertia + part.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    assert mass == pytest.approx(row["mass"])
    np.testing.assert_allclose(com, row["com"], atol=1e-12)
    np.testing.assert_allclose(
        inertia[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)], row["inertia"], atol=1e-12
    )


def test_thirty_moving_joints_in_the_robots_order():
    """Moving joints come first, chain by chain."""
    moving = [joint.name for joint in TABLE.joints if joint.axis]
    counts = {"RLEG": 6, "LLEG": 6, "CHEST": 2, "HEAD": 2, "RARM": 7, "LARM": 7}
    assert moving == [f"{chain}_JOINT{i}" for chain, n in counts.items() for i in range(n)]
    assert [joint.name for joint in TABLE.joints[:30]] == moving


def test_outer_size():
    """With arms down and straight knees, the shapes have the width, depth and height of HRP-2."""
    place = {"base_link": np.zeros(3)}
    for joint in [*TABLE.joints[:30], *TABLE.joints[30:]]:
        place[joint.child] = place[joint.parent] + joint.xyz
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for link in TABLE.links:
        for shape in link.shapes:
            half = {
                "box": lambda s: np.array(s) / 2,
                "sphere": lambda s: np.full(3, s[0]),
                "cylinder": lambda s: np.array([s[0], s[0], s[1] / 2]),
            }[shape.kind](shape.size)
            if abs(shape.rpy[0]) > 1.0:
                half = half[[0, 2, 1]]
            if abs(shape.rpy[1]) > 1.0:
                half = half[[2, 1, 0]]
            middle = place[link.name] + shape.xyz
            low, high = np.minimum(low, middle - half), np.maximum(high, middle + half)
    depth, width, height = high - low
    assert width == pytest.approx(0.62, abs=0.005)
    assert 1.535 < height < 1.565
    assert depth == pytest.approx(0.355, abs=0.01)


def test_a_bad_inertia_is_refused(tmp_path):
    """A moment of inertia that no body can have is an error that names the link."""

    def edit(data):
        data["links"]["RLEG_LINK4"]["inertia"][2] = 0.01

    with pytest.raises(ModelTableError, match="RLEG_LINK4") as caught:
        load_model_table(_edited_table(tmp_path, edit))
    assert caught.value.value[2] == pytest.approx(0.01, rel=1e-3)


def test_links_heavier_than_the_robot_are_refused(tmp_path):
    """The trunk never gets less than its published mass."""
    with pytest.raises(ModelTableError, match="outweigh") as caught:
        load_model_table(_edited_table(tmp_path, lambda data: data.update(total_mass=50.0)))
    assert caught.value.limit == 50.0


vectors = st.lists(st.floats(-0.2, 0.2), min_size=3, max_size=3).map(np.array)


@given(vectors, vectors, st.floats(0.1, 5.0), st.floats(0.1, 5.0))
def test_taking_a_part_off_undoes_adding_it(com_a, com_b, mass_a, mass_b):
    """A body plus a part minus the part is the body again."""
    body_a = Inertial(mass_a, com_a, np.diag([0.1, 0.2, 0.25]))
    body_b = Inertial(mass_b, com_b, np.diag([0.02, 0.03, 0.04]))
    mass = mass_a + mass_b
    com = (mass_a * com_a + mass_b * com_b) / mass
    inertia = np.zeros((3, 3))
    for body in (body_a, body_b):
        arm = body.com - com
        inertia += body.inertia + body.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    left = Inertial(mass, com, inertia).without(body_b)
    assert left.mass == pytest.approx(mass_a)
    np.testing.assert_allclose(left.com, com_a, atol=1e-9)
    np.testing.assert_allclose(left.inertia, body_a.inertia, atol=1e-9)
