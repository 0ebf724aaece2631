"""HRP-2 in disguise: other names in another order, and sensors elsewhere; it has to do the same."""

import random
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from door_impact_common.arrays import Array
from hrp2_description.data import data_path
from hrp2_description.robot import RobotConfig, load_robot_config


@dataclass(frozen=True)
class Disguise:
    """The robot in disguise.

    Attributes:
        config: Its configuration.
        order: For each of HRP-2's joints that it has, its column in the disguise, (J,).
    """

    config: RobotConfig
    order: Array


def disguised(folder: Path, *, fixed: tuple[str, ...] = ()) -> Disguise:
    """Write URDF and robot.yaml of the disguise into a folder, and read them.

    Root link and joints have other names, the joints another order.

    Args:
        folder: The folder.
        fixed: HRP-2's joints that the disguise does not have.
    """
    plain = load_robot_config()
    tree = ET.parse(plain.urdf_path).getroot()
    frames = {joint.attrib["name"]: joint for joint in tree.findall("joint")}
    for joint in fixed:
        frames[joint].set("type", "fixed")
    shuffled = [name for name in plain.joint_names if name not in fixed]
    random.Random(4).shuffle(shuffled)
    names = {name: f"dof{number:02d}_of_it" for number, name in enumerate(shuffled)}
    names[plain.root_link] = "pelvis"
    for element in tree.iter():
        if element.tag in ("link", "joint", "parent", "child"):
            for key in ("name", "link"):
                if element.get(key) in names:
                    element.set(key, names[element.attrib[key]])
    ET.ElementTree(tree).write(folder / "it.urdf")
    file = yaml.safe_load(data_path("config/robot.yaml").read_text())
    file |= {"joint_names": shuffled, "urdf": "it.urdf"}
    for key in ("half_sitting_deg", "drives"):
        file[key] = {name: row for start, table in file[key].items() for name, row in _by_joint(
            [name for name in plain.joint_names if name.startswith(start)], table)
            if name in shuffled}
    (folder / "it.yaml").write_text(yaml.safe_dump(_renamed(file, names)))
    order = [shuffled.index(name) for name in plain.joint_names if name in shuffled]
    return Disguise(load_robot_config(folder / "it.yaml"), np.array(order))


def _by_joint(names: list[str], table: Any) -> Any:
    for index, name in enumerate(names):
        yield name, ([table[index]] if isinstance(table, list) else
                     {key: [values[index]] for key, values in table.items()})


def _renamed(value: Any, names: dict[str, str]) -> Any:
    if isinstance(value, dict):
        return {names.get(key, key): _renamed(each, names) for key, each in value.items()}
    if isinstance(value, list):
        return [_renamed(each, names) for each in value]
    return names.get(value, value) if isinstance(value, str) else value
