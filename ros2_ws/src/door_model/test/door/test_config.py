"""Configurations of doors as YAML files."""

from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from door_model.door.config import door_names, load_door, load_geometry
from door_model.door.door import Zone
from door_model.door.geometry import plate_moment_of_inertia
from door_model.errors import ConfigError
from door_model.tools import check_door

HALL = """name: hall
leaf: {mass: 47.62, width: 0.896, height: 2.0, thickness: 0.04}
linkage: {l: 0.195, l1: 0.204, l2: 0.22, l3: 0.265, theta_i0: 0.34}
closer: {c_c: 0.06, k_c: 1.13, tau_c0_prime: 3.2}
restitution: 0.5
"""


def edited(tmp_path: Path, section: str | None, key: str, value: object) -> Path:
    """Return the YAML text of the paper's door with one value changed (None removes it)."""
    document = yaml.safe_load(load_door("paper").to_yaml())
    target = document if section is None else document[section]
    if value is None:
        del target[key]
    else:
        target[key] = value
    path = tmp_path / "door.yaml"
    path.write_text(yaml.safe_dump(document))
    return path


def test_doors_that_come_with_the_package() -> None:
    """All doors of the package load, and their linkages close up to 90 deg."""
    assert door_names() == [
        "light", "paper", "size2", "size2_leaf", "size3", "size3_leaf", "size4", "size4_leaf"
    ]
    for name in door_names():
        door = load_door(name).door()
        assert door.restoring_torque(1.57) > 0.0


@pytest.mark.parametrize(("name", "torque"), [("size2", 13.0), ("size3", 18.0), ("size4", 26.0)])
def test_sizes_have_their_closing_moment(name: str, torque: float) -> None:
    """Each size has the least moment of EN 1154 at the closed door."""
    for door in (load_door(name), load_door(f"{name}_leaf")):
        assert door.door().restoring_torque(0.0) == pytest.approx(torque, abs=1e-5)


@pytest.mark.parametrize(("name", "mass", "width"), [
    ("size2_leaf", 40.0, 0.85), ("size3_leaf", 60.0, 0.95), ("size4_leaf", 80.0, 1.1)])
def test_leaves_of_the_standard(name: str, mass: float, width: float) -> None:
    """Each power size has the leaf of EN 1154 and its moment of inertia."""
    config = load_door(name)
    assert (config.leaf.mass, config.leaf.width) == (mass, width)
    assert config.i_a == plate_moment_of_inertia(mass, width)


def test_the_moment_of_inertia_is_that_of_the_leaf(tmp_path: Path) -> None:
    """47.62 kg and 0.896 m give the paper's 12.75 kg m^2, also where a file leaves it out."""
    config = load_door("paper")
    assert config.leaf.moment_of_inertia() == pytest.approx(config.i_a, rel=1e-3)
    bare = load_door(edited(tmp_path, None, "i_a", None))
    assert bare.i_a == config.leaf.moment_of_inertia() == plate_moment_of_inertia(47.62, 0.896)


def test_yaml_round_trip_of_a_real_closer(tmp_path: Path) -> None:
    """What is written is read back, with the extensions of the paper's model."""
    path = tmp_path / "real.yaml"
    real = replace(
        load_door("paper"), c_c_closing=0.5, backcheck=Zone(1.2, 3.0), latch=Zone(0.2, 0.1),
        friction=0.3, linkage=replace(load_door("paper").linkage, l3=0.26),
    )
    path.write_text(real.to_yaml())
    assert load_door(path) == real
    assert load_door(path).door().friction == 0.3


def test_geometry_does_not_know_the_closer(tmp_path: Path) -> None:
    """The geometry contains nothing of the closer's section, whatever that contains."""
    path = edited(tmp_path, "closer", "k_c", "wrong")
    assert load_geometry(path) == load_geometry("paper")
    assert load_geometry("paper").linkage == load_door("paper").linkage
    assert load_geometry(edited(tmp_path, None, "closer", None)) == load_geometry("paper")


@pytest.mark.parametrize(("section", "key", "value", "match"), [
    (None, "linkage", None, "linkage"), (None, "colour", "red", "colour"),
    ("leaf", "width", "wide", "width"), ("linkage", "l3", 0.6, "l3"),
    ("closer", "tau_c0_prime", -3.0, "tau_c0_prime"), ("closer", "latch", {"angle": 0.1}, "latch"),
    ("linkage", "assembly", -1, "does not pull the door shut")])
def test_what_is_wrong_is_said(
    tmp_path: Path, section: str | None, key: str, value: object, match: str
) -> None:
    """Unknown and missing keys and numbers out of range are named, with the file."""
    path = edited(tmp_path, section, key, value)
    with pytest.raises(ConfigError, match=match) as caught:
        load_door(path)
    assert caught.value.source == str(path)


@pytest.mark.parametrize(("old", "new", "match"), [
    ("47.62", "47620", r"leaf mass .*\(grams\?\), not 47620"), ("47.62", "0.048", "density"),
    ("47.62", ".nan", "finite"), ("47.62", "'47,62'", "47,62"), ("47.62", "047", "047 is no decim"),
    ("0.896", "896", r"leaf width .*\(mm\?\), not 896"), ("0.265", "265", r"l3 .*\(mm\?\), not 2"),
    ("0.34", "19.48", r"theta_i0 .*\(degrees\?\), not 19.48"),
    ("3.2", "3.2, backcheck: {angle: 20, c_c: 3.0}", r"zone .*\(degrees\?\), not 20"),
    ("3.2", "3.2, latch: {angle: 8, c_c: 3.0}", r"zone .*\(degrees\?\), not 8"),
    ("3.2", "3200", "N mm"), ("1.13", "1,13", "decimal number has a point"),
    ("0.5", "50", "1 or less"), ("0.5", "0.5\ni_a: 127.5", "38.2301 kg m.2, with all mass at the"),
    ("0.5", "0.5\nfriction: 9.2", "does not pull the door shut against a friction of 9.2"),
    ("0.5", "0.5\nleaf: {}", "line 6, column 1: the key 'leaf' is there twice")])
def test_numbers_of_another_unit_spelling_or_door_are_refused(
        tmp_path: Path, old: str, new: str, match: str) -> None:
    """The message has the value, and asks for the unit that it may have."""
    path = tmp_path / "door.yaml"
    path.write_text(HALL.replace(old, new))
    with pytest.raises(ConfigError, match=match):
        load_door(path)


def test_numbers_with_exponents_are_numbers(tmp_path: Path) -> None:
    path = tmp_path / "door.yaml"
    path.write_text(HALL.replace("0.06", "6e-2"))
    assert load_door(path).c_c == 0.06


def test_what_is_improbable_is_doubted_and_no_door_of_the_package_is() -> None:
    """A backcheck beyond the linkage's range never acts; a third of the inertia is odd."""
    paper = load_door("paper")
    limit = paper.linkage.opening_limit()
    odd = replace(paper, backcheck=Zone(limit + 0.01, 3.0), i_a=4.0)
    assert len(odd.doubts()) == 2
    assert "never acts" in odd.doubts()[1]
    assert not any(load_door(name).doubts() for name in door_names())


def test_check_door_prints_the_door_and_ends_with_1_for_one_that_is_refused(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The paper's closer pulls with 9.12 N m at 0 deg, size 1; that of size3 has size 3."""
    assert check_door.main(["paper"]) == check_door.main(["size3"]) == 0
    out = capsys.readouterr().out
    assert "9.12 N m at 0 deg, 5.70 N m at 10 deg, 4.61 N m at 25 deg; size 1" in out
    assert "size 3 of EN 1154" in out
    assert out.count("doubt: none") == 2
    path = edited(tmp_path, "closer", "backcheck", {"angle": 20.0, "c_c": 3.0})
    assert check_door.main([str(path)]) == 1
    assert "degrees?" in capsys.readouterr().err


def test_no_such_door(tmp_path: Path) -> None:
    """The error lists the known doors for an unknown name; a file may also hold something else."""
    with pytest.raises(ConfigError, match="paper, size2"):
        load_door("garage")
    (tmp_path / "door.yaml").write_text("- a\n- b\n")
    for path in ("nowhere/door.yaml", tmp_path / "door.yaml"):
        with pytest.raises(ConfigError, match=r"door\.yaml"):
            load_door(path)
