"""Configurations of doors as YAML files."""

from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from door_model.door.config import door_names, load_door, load_geometry
from door_model.door.door import Zone
from door_model.door.geometry import plate_moment_of_inertia
from door_model.errors import ConfigError


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
        "paper", "size2", "size2_leaf", "size3", "size3_leaf", "size4", "size4_leaf"
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
    assert load_geometry(path) == load_geometry("paper") == load_door("paper").geometry()
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


def test_no_such_door(tmp_path: Path) -> None:
    """The error lists the known doors for an unknown name; a file may also hold something else."""
    with pytest.raises(ConfigError, match="paper, size2"):
        load_door("garage")
    (tmp_path / "door.yaml").write_text("- a\n- b\n")
    for path in ("nowhere/door.yaml", tmp_path / "door.yaml"):
        with pytest.raises(ConfigError, match=r"door\.yaml"):
            load_door(path)
