"""Reads the robot's configuration (config/robot.yaml) together with the limits of its URDF."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import InputError
from door_impact_common.files import read_file
from door_impact_common.yaml_files import read_yaml

from hrp2_description.data import data_path, share_folders
from hrp2_description.errors import DataFileNotFoundError, RobotConfigError
from hrp2_description.robot_types import (
    Arm,
    Brace,
    Drives,
    FootNames,
    Pad,
    RobotConfig,
    SoleRubber,
    Step,
    WristSensor,
    needed,
)
from hrp2_description.step_limits import StepLimits, read_step_limits

__all__ = [
    "Brace", "Drives", "RobotConfig", "SoleRubber", "StepLimits", "load_robot_config", "needed",
]

T = TypeVar("T")
SIDES = ("left", "right")  # the order of the sides in every array
LEG_JOINTS = 6  # number of joints of a leg
# Types of joints without a limited range.
_FIXED_TYPES = ("fixed", "floating", "planar")
_IN_PACKAGE = "package://"
_UNIT = 1e-6  # largest deviation of a unit vector's length


def load_robot_config(
    path: str | Path | None = None, folders: Sequence[Path] | None = None
) -> RobotConfig:
    """Read the robot's configuration.

    The file must name all joints of the URDF in ``joint_names``. With ``other_joints: fixed`` the
    joints that it does not name, such as fingers, stay at zero.

    Args:
        path: YAML file in the form of config/robot.yaml, which is the default. Its field ``urdf``
            is a path relative to the file's folder, to the parent of that folder, or to this
            package's data; or it begins with ``package://`` and the name of a package that ROS or
            pip has installed.
        folders: Folders that may contain the file and its URDF, as for
            `door_impact_common.files.read_file`; None allows every folder. Installed packages may
            always contain the URDF.

    Raises:
        RobotConfigError: The file cannot be read, or a field is missing, is unusable, or
            contradicts the URDF.
    """
    if path is None:
        path, folders = data_path("config/robot.yaml"), None
    file = Path(path)
    try:
        data = read_yaml(file, folders)
        if not isinstance(data, dict):
            raise RobotConfigError(f"{file} is not a mapping", value=data, limit="a mapping")
        urdf = str(data["urdf"])
        installed = urdf.startswith(_IN_PACKAGE)
        return _build(data, _find_urdf(urdf, file), None if installed else folders)
    except RobotConfigError:
        raise
    except KeyError as error:
        raise RobotConfigError(f"{file}: missing field", value=None, limit=error.args[0]) from error
    except (InputError, ET.ParseError, AttributeError, TypeError, ValueError, LookupError,
            OverflowError) as error:
        raise RobotConfigError(
            f"{file} cannot be read", value=str(error), limit="fields as in config/robot.yaml"
        ) from error


def _build(
    data: dict[str, Any], urdf_path: Path, folders: Sequence[Path] | None
) -> RobotConfig:
    names = tuple(data["joint_names"])
    robot = ET.fromstring(read_file(urdf_path, folders))
    limits = _read_limits(robot, names, data.get("other_joints"))
    braced = {name: float(np.deg2rad(deg)) for name, deg in data["braced_posture_deg"].items()}
    x_min, x_max, y_min, y_max = (float(value) for value in data["sole"])
    config = RobotConfig(
        name=data["name"],
        mass=sum(float(element.attrib["value"]) for element in robot.iter("mass")),
        joint_names=names,
        half_sitting=_frozen(
            np.deg2rad(_per_joint(data["half_sitting_deg"], names, "half_sitting_deg"))
        ),
        lower=_frozen(limits[:, 0]),
        upper=_frozen(limits[:, 1]),
        velocity_limit=_frozen(limits[:, 2]),
        effort_limit=_frozen(limits[:, 3]),
        legs=MappingProxyType({side: tuple(data["legs"][side]) for side in SIDES}),
        arm=_arm(data["arm"]),
        step=Step(**{name: float(value) for name, value in data["step"].items()}),
        run_up_start=_range(data, "run_up_start"),
        soles=MappingProxyType(
            {"left": (x_min, x_max, -y_max, -y_min), "right": (x_min, x_max, y_min, y_max)}
        ),
        feet=MappingProxyType({side: FootNames(**data["feet"][side]) for side in SIDES}),
        contact_link=data["contact_link"],
        contact_radius=_positive(data, "contact_radius"),
        hand_link=data["hand_link"],
        braced_posture=MappingProxyType(braced),
        braced_joints=tuple(data["braced_joints"]),
        urdf_path=urdf_path,
        **_optional(data, names),
    )
    _check_names(config, robot)
    _check_chains(config)
    _check_postures(config)
    return config


def _optional(data: dict[str, Any], names: tuple[str, ...]) -> dict[str, Any]:
    """Return those fields of the file that it may omit."""
    found: dict[str, Any] = {}
    for name in ("hand_radius", "clearance"):
        if name in data:
            found[name] = _positive(data, name)
    if "drives" in data:
        found["drives"] = _drives(data, names)
    if "brace" in data:
        found["brace"] = _brace(data["brace"])
    if "motor_encoder_counts" in data:
        counts = found["motor_encoder_counts"] = data["motor_encoder_counts"]
        if type(counts) is not int or counts < 1:
            raise RobotConfigError(
                "motor_encoder_counts", value=counts, limit="a whole number, 1 or more"
            )
    if "sole_rubber" in data:
        found["sole_rubber"] = _sole_rubber(data["sole_rubber"])
    if "disabled_collisions" in data:
        found["disabled_collisions"] = tuple((a, b) for a, b in data["disabled_collisions"])
    if "wrist_sensors" in data:
        found["wrist_sensors"] = MappingProxyType(
            {side: WristSensor(**data["wrist_sensors"][side]) for side in SIDES})
    if "footsteps" in data:
        found["footsteps"] = read_step_limits(data["footsteps"])
    found |= {name: data[name] for name in ("imu_frame", "chest_yaw") if name in data}
    return found


def _arm(data: dict[str, Any]) -> Arm:
    return Arm(
        joints=tuple(data["joints"]),
        elbow=data["elbow"],
        straightest_elbow=float(np.deg2rad(data["straightest_elbow_deg"])),
        wrist_link=data["wrist_link"],
        heights=_range(data, "heights"),
    )


def _drives(data: dict[str, Any], names: tuple[str, ...]) -> Drives:
    rows = {key: {start: row[key] for start, row in data["drives"].items()}
            for key in ("gear", "rotor_inertia", "size", "position_gain", "speed_gain")}
    columns = {key: _per_joint(table, names, key) for key, table in rows.items()}
    sizes, decay = data["gear_sizes"], _positive(data, "gear_damping_time")
    for name, size in zip(names, columns["size"], strict=True):
        if size not in sizes:
            raise RobotConfigError(
                f"size of the gear of {name}", value=float(size), limit=f"one of {sorted(sizes)}")
    gears = {key: np.array([float(sizes[int(size)][key]) for size in columns["size"]])
             for key in ("stiffness", "peak_torque", "ratcheting_torque")}
    drives = Drives(
        gear_ratio=_frozen(columns["gear"]),
        rotor_inertia=_frozen(columns["rotor_inertia"]),
        damping=_frozen(decay * gears["stiffness"]),
        position_gain=_frozen(columns["position_gain"]),
        speed_gain=_frozen(columns["speed_gain"]),
        **{key: _frozen(values) for key, values in gears.items()},
    )
    weak = np.flatnonzero(gears["ratcheting_torque"] < gears["peak_torque"])
    if weak.size:
        at = int(weak[0])
        raise RobotConfigError(
            f"ratcheting_torque of the gear of {names[at]}",
            value=float(gears["ratcheting_torque"][at]),
            limit=f"at least its peak_torque, {gears['peak_torque'][at]:g}")
    for name, values in asdict(drives).items():
        wrong = np.flatnonzero(~(np.isfinite(values) & (values > 0.0)))
        if wrong.size:
            at = int(wrong[0])
            raise RobotConfigError(
                f"{name} of {names[at]}", value=float(values[at]), limit="positive")
    return drives


def _brace(data: dict[str, Any]) -> Brace:
    arm, trunk = (
        Pad(pad["link"], _vector(pad, "xyz"), _positive(pad, "radius"))
        for pad in (data["arm"], data["trunk"]))
    normal = _vector(data["trunk"], "normal")
    if not abs(float(np.linalg.norm(normal)) - 1.0) < _UNIT:
        raise RobotConfigError("normal of the trunk's pad", value=normal, limit="length 1")
    stiffness, damping, friction = (
        _positive(data, name) for name in ("stiffness", "damping", "friction"))
    return Brace(arm, trunk, normal, stiffness, damping, friction)


def _vector(data: dict[str, Any], name: str) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in data[name])
    if not np.isfinite([x, y, z]).all():
        raise RobotConfigError(name, value=(x, y, z), limit="three finite numbers")
    return x, y, z


def _sole_rubber(data: dict[str, Any]) -> SoleRubber:
    rubber = SoleRubber(float(data["stiffness"]), float(data["damping"]))
    for name, value in asdict(rubber).items():
        if not (np.isfinite(value) and value > 0.0):
            raise RobotConfigError(f"{name} of sole_rubber", value=value, limit="positive")
    return rubber


def _check_names(config: RobotConfig, robot: ET.Element) -> None:
    links = {element.attrib["name"] for element in robot.findall("link")}
    joints = {element.attrib["name"] for element in robot.findall("joint")}
    named_links = [config.contact_link, config.hand_link, config.arm.wrist_link, config.imu_frame]
    named_links += [link for pair in config.disabled_collisions for link in pair]
    if config.brace is not None:
        named_links += [config.brace.arm.link, config.brace.trunk.link]
    named_joints: list[str | None] = [
        *config.braced_joints, *config.braced_posture, config.chest_yaw]
    for foot in config.feet.values():
        named_links += [foot.sole, foot.ankle]
        named_joints.append(foot.sensor_joint)
    for sensor in (config.wrist_sensors or {}).values():
        named_links.append(sensor.link)
        named_joints.append(sensor.joint)
    for what, named, known in (("links", named_links, links), ("joints", named_joints, joints)):
        unknown = sorted({name for name in named if name is not None} - known)
        if unknown:
            raise RobotConfigError(
                f"{what} that the URDF does not have", value=unknown, limit=f"{what} of the URDF"
            )


def _check_chains(config: RobotConfig) -> None:
    chains = {"the right arm": config.arm.joints}
    chains |= {f"the {side} leg": joints for side, joints in config.legs.items()}
    for what, joints in chains.items():
        strange = sorted(set(joints) - set(config.joint_names))
        if strange or (what != "the right arm" and len(joints) != LEG_JOINTS):
            raise RobotConfigError(
                f"joints of {what}",
                value=strange or list(joints),
                limit=f"names in joint_names, {LEG_JOINTS} for a leg",
            )
    if config.arm.elbow not in config.arm.joints:
        raise RobotConfigError(
            "elbow of the right arm", value=config.arm.elbow, limit=list(config.arm.joints)
        )
    step = config.step
    if not 0.0 < step.shortest < step.nominal < step.longest or not step.lift > 0.0:
        raise RobotConfigError(
            "step", value=asdict(step), limit="0 < shortest < nominal < longest, lift > 0"
        )


def _check_postures(config: RobotConfig) -> None:
    postures = {
        "half_sitting": config.half_sitting,
        "braced": config.posture(config.braced_posture),
    }
    for name, posture in postures.items():
        outside = (posture < config.lower) | (posture > config.upper)
        if outside.any():
            at = int(np.flatnonzero(outside)[0])
            raise RobotConfigError(
                f"{name} puts {config.joint_names[at]} outside its limits",
                value=float(posture[at]),
                limit=(float(config.lower[at]), float(config.upper[at])),
            )


def _positive(data: dict[str, Any], name: str) -> float:
    value = float(data[name])
    if not (np.isfinite(value) and value > 0.0):
        raise RobotConfigError(name, value=value, limit="a positive number")
    return value


def _range(data: dict[str, Any], name: str) -> tuple[float, float]:
    low, high = (float(value) for value in data[name])
    if not low < high:
        raise RobotConfigError(name, value=(low, high), limit="two numbers, the lower one first")
    return low, high


def _read_limits(robot: ET.Element, names: tuple[str, ...], others: str | None) -> Array:
    """Return lower limit, upper limit, largest speed and largest torque of the joints, (J, 4)."""
    if others not in (None, "fixed"):
        raise RobotConfigError("other_joints", value=others, limit="fixed, or no such field")
    joints = {
        joint.attrib["name"]: joint
        for joint in robot.findall("joint")
        if joint.attrib["type"] not in _FIXED_TYPES
    }
    different = set(names) - set(joints) if others else set(names) ^ set(joints)
    if different or len(set(names)) != len(names):
        raise RobotConfigError(
            "joint_names and the URDF's joints differ",
            value=sorted(different),
            limit="joints of the URDF, each of them once" if others else "the same set",
        )
    rows = []
    for name in names:
        kind = joints[name].attrib["type"]
        if kind != "revolute" or joints[name].find("mimic") is not None:
            raise RobotConfigError(
                f"joint {name} has a type that cannot be used", value=kind,
                limit="revolute, without mimic",
            )
        limit = joints[name].find("limit")
        found = {} if limit is None else limit.attrib
        try:
            rows.append([float(found[key]) for key in ("lower", "upper", "velocity", "effort")])
        except KeyError as missing:
            raise RobotConfigError(
                f"the URDF lacks a limit of {name}", value=dict(found), limit=missing.args[0]
            ) from None
    return np.array(rows)


def _by_joint(
    table: Mapping[str, Sequence[T]], names: tuple[str, ...], what: str
) -> dict[str, T]:
    """Return the values of a table by joint.

    Args:
        table: Values for the joints whose names have a common beginning, for example
            ``RLEG: [0, ...]``.
        names: Names of all joints.
        what: Name of the table for error messages.

    Raises:
        RobotConfigError: A beginning matches no joint, or the number of values differs.
    """
    values: dict[str, T] = {}
    for beginning, row in table.items():
        joints = [name for name in names if name.startswith(beginning)]
        if not joints or len(row) != len(joints):
            raise RobotConfigError(
                f"{what} of {', '.join(joints) or f'{beginning}, which begins no joint name'}",
                value=row,
                limit=f"{len(joints)} values",
            )
        values |= zip(joints, row, strict=True)
    return values


def _per_joint(
    table: Mapping[str, Sequence[float]], names: tuple[str, ...], what: str
) -> Array:
    values = _by_joint(table, names, what)
    missing = [name for name in names if name not in values]
    if missing:
        raise RobotConfigError(
            f"{what} is missing for some joints", value=missing, limit="a value for each joint"
        )
    return np.array([float(values[name]) for name in names])


def _find_urdf(name: str, config_file: Path) -> Path:
    if name.startswith(_IN_PACKAGE):
        package, _, place = name.removeprefix(_IN_PACKAGE).partition("/")
        tried = [folder / place for folder in share_folders(package)]
    else:
        tried = [folder / name for folder in (config_file.parent, config_file.parent.parent)]
    for path in tried:
        if path.is_file():
            return path
    try:
        return data_path(name)
    except DataFileNotFoundError:
        raise RobotConfigError(
            "there is no URDF",
            value=name,
            limit=f"a file in the folder of {config_file}, or package:// and an installed package",
        ) from None


def _frozen(values: Array) -> Array:
    values = np.array(values, dtype=float)
    values.setflags(write=False)
    return values
