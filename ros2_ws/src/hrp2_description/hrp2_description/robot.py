"""Reads the robot's configuration (config/robot.yaml) together with the limits of its URDF."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Generic, Literal, TypeVar

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.documents import (
    Count,
    Name,
    Number,
    Part,
    Positive,
    Range,
    Vector,
    checked,
)
from door_impact_common.errors import InputError, SettingError
from door_impact_common.files import read_file
from door_impact_common.yaml_files import read_yaml
from pydantic import field_validator, model_validator

from hrp2_description.data import data_path, share_folders
from hrp2_description.errors import RobotConfigError
from hrp2_description.robot_types import (
    Arm,
    Brace,
    Drives,
    FootNames,
    Pad,
    RobotConfig,
    SoleRubber,
    Step,
    StepLimits,
    WristSensor,
    needed,
)

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
_Names = tuple[Name, ...]


class _Sides(Part, Generic[T]):
    left: T
    right: T

    def mapping(self) -> Mapping[str, T]:
        return MappingProxyType({"left": self.left, "right": self.right})


class _Arm(Part):
    joints: _Names
    elbow: Name
    straightest_elbow_deg: Number
    wrist_link: Name
    heights: Range


class _Footsteps(Part):
    ahead: Positive
    back: Positive
    width: Positive
    narrowest: Positive
    widest: Positive
    turn_deg: Positive
    clearance: Positive

    @model_validator(mode="after")
    def _wide_enough(self) -> _Footsteps:
        if not self.narrowest <= self.width <= self.widest:
            raise ValueError(f"a width from narrowest to widest, not {self.width:g}")
        return self


class _Row(Part):
    gear: tuple[Positive, ...]
    rotor_inertia: tuple[Positive, ...]
    size: tuple[int, ...]
    position_gain: tuple[Positive, ...]
    speed_gain: tuple[Positive, ...]


class _GearSize(Part):
    stiffness: Positive
    peak_torque: Positive
    ratcheting_torque: Positive

    @model_validator(mode="after")
    def _ratchets_last(self) -> _GearSize:
        if self.ratcheting_torque < self.peak_torque:
            raise ValueError(f"a ratcheting_torque of at least peak_torque, {self.peak_torque:g}")
        return self


class _Pad(Part):
    link: Name
    xyz: Vector
    radius: Positive


class _Disc(_Pad):
    normal: Vector

    @field_validator("normal")
    @classmethod
    def _unit(cls, normal: Vector) -> Vector:
        if not abs(float(np.linalg.norm(normal)) - 1.0) < _UNIT:
            raise ValueError("a vector of length 1")
        return normal


class _Brace(Part):
    arm: _Pad
    trunk: _Disc
    stiffness: Positive
    damping: Positive
    friction: Positive


class _File(Part):
    """The fields of robot.yaml; that file says what they mean."""

    name: Name
    urdf: Name
    joint_names: _Names
    other_joints: Literal["fixed"] | None = None
    legs: _Sides[_Names]
    arm: _Arm
    step: Step
    footsteps: _Footsteps | None = None
    chest_yaw: Name | None = None
    run_up_start: Range
    half_sitting_deg: dict[Name, tuple[Number, ...]]
    drives: dict[Name, _Row] | None = None
    gear_sizes: dict[int, _GearSize] | None = None
    gear_damping_time: Positive | None = None
    motor_encoder_counts: Count | None = None
    sole: tuple[Number, Number, Number, Number]
    sole_rubber: SoleRubber | None = None
    feet: _Sides[FootNames]
    wrist_sensors: _Sides[WristSensor] | None = None
    imu_frame: Name | None = None
    contact_link: Name
    contact_radius: Positive
    hand_link: Name
    hand_radius: Positive | None = None
    clearance: Positive = RobotConfig.clearance
    disabled_collisions: tuple[tuple[Name, Name], ...] = ()
    braced_posture_deg: dict[Name, Number]
    brace: _Brace | None = None
    braced_joints: _Names


def load_robot_config(path: str | Path | None = None) -> RobotConfig:
    """Read the robot's configuration.

    The file must name all joints of the URDF in ``joint_names``. With ``other_joints: fixed`` the
    joints that it does not name, such as fingers, stay at zero.

    Args:
        path: YAML file in the form of config/robot.yaml, which is the default. Its field ``urdf``
            is a path relative to the file's folder, to the parent of that folder, or to this
            package's data; or it begins with ``package://`` and the name of a package that ROS or
            pip has installed.

    Raises:
        RobotConfigError: The file cannot be read, or a field is missing, unknown or unusable, or
            contradicts the URDF.
    """
    file = data_path("config/robot.yaml") if path is None else Path(path)
    try:
        found = checked(_File, read_yaml(file))
        urdf_path = _find_urdf(found.urdf, file)
        return _build(found, urdf_path, ET.fromstring(read_file(urdf_path)))
    except SettingError as error:
        raise RobotConfigError(
            f"{file}: {error.setting}", value=error.value, limit=error.limit) from error
    except (InputError, ET.ParseError, KeyError, ValueError) as error:
        if isinstance(error, RobotConfigError):
            raise
        raise RobotConfigError(
            f"{file} cannot be used", value=str(error), limit="a robot.yaml with its URDF"
        ) from error


def _build(file: _File, urdf_path: Path, urdf: ET.Element) -> RobotConfig:
    names = file.joint_names
    limits = _read_limits(urdf, names, file.other_joints)
    x_min, x_max, y_min, y_max = file.sole
    arm = file.arm
    config = RobotConfig(
        name=file.name,
        mass=sum(float(element.attrib["value"]) for element in urdf.iter("mass")),
        joint_names=names,
        half_sitting=_frozen(
            np.deg2rad(_per_joint(file.half_sitting_deg, names, "half_sitting_deg"))
        ),
        lower=_frozen(limits[:, 0]),
        upper=_frozen(limits[:, 1]),
        velocity_limit=_frozen(limits[:, 2]),
        effort_limit=_frozen(limits[:, 3]),
        legs=file.legs.mapping(),
        arm=Arm(arm.joints, arm.elbow, float(np.deg2rad(arm.straightest_elbow_deg)),
                arm.wrist_link, arm.heights),
        step=file.step,
        run_up_start=file.run_up_start,
        soles=MappingProxyType(
            {"left": (x_min, x_max, -y_max, -y_min), "right": (x_min, x_max, y_min, y_max)}
        ),
        feet=file.feet.mapping(),
        contact_link=file.contact_link,
        contact_radius=file.contact_radius,
        hand_link=file.hand_link,
        braced_posture=MappingProxyType(
            {name: float(np.deg2rad(deg)) for name, deg in file.braced_posture_deg.items()}),
        braced_joints=file.braced_joints,
        urdf_path=urdf_path,
        hand_radius=file.hand_radius,
        clearance=file.clearance,
        disabled_collisions=file.disabled_collisions,
        drives=_drives(file, names),
        motor_encoder_counts=file.motor_encoder_counts,
        brace=_brace(file.brace),
        sole_rubber=file.sole_rubber,
        imu_frame=file.imu_frame,
        wrist_sensors=file.wrist_sensors.mapping() if file.wrist_sensors else None,
        footsteps=_footsteps(file.footsteps),
        chest_yaw=file.chest_yaw,
    )
    _check_names(config, urdf)
    _check_chains(config)
    _check_postures(config)
    return config


def _footsteps(given: _Footsteps | None) -> StepLimits | None:
    if given is None:
        return None
    values = given.model_dump()
    return StepLimits(turn=float(np.deg2rad(values.pop("turn_deg"))), **values)


def _brace(given: _Brace | None) -> Brace | None:
    if given is None:
        return None
    arm, trunk = (Pad(pad.link, pad.xyz, pad.radius) for pad in (given.arm, given.trunk))
    return Brace(arm, trunk, given.trunk.normal, given.stiffness, given.damping, given.friction)


def _drives(file: _File, names: tuple[str, ...]) -> Drives | None:
    if file.drives is None:
        return None
    sizes, decay = needed(file.gear_sizes, "gear_sizes"), file.gear_damping_time
    rows = {start: row.model_dump() for start, row in file.drives.items()}
    columns = {key: _per_joint({start: row[key] for start, row in rows.items()}, names, key)
               for key in _Row.model_fields}
    for name, size in zip(names, columns["size"], strict=True):
        if size not in sizes:
            raise RobotConfigError(
                f"size of the gear of {name}", value=int(size), limit=f"one of {sorted(sizes)}")
    gears = {key: np.array([getattr(sizes[int(size)], key) for size in columns["size"]])
             for key in _GearSize.model_fields}
    return Drives(
        gear_ratio=_frozen(columns["gear"]),
        rotor_inertia=_frozen(columns["rotor_inertia"]),
        damping=_frozen(needed(decay, "gear_damping_time") * gears["stiffness"]),
        position_gain=_frozen(columns["position_gain"]),
        speed_gain=_frozen(columns["speed_gain"]),
        **{key: _frozen(values) for key, values in gears.items()},
    )


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


def _read_limits(robot: ET.Element, names: tuple[str, ...], others: str | None) -> Array:
    """Return lower limit, upper limit, largest speed and largest torque of the joints, (J, 4)."""
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
        tried = [config_file.parent / name, config_file.parent.parent / name, data_path(name)]
    for path in tried:
        if path.is_file():
            return path
    raise RobotConfigError(
        "there is no URDF", value=name,
        limit=f"a file in the folder of {config_file}, or package:// and an installed package")


def _frozen(values: Array) -> Array:
    values = np.array(values, dtype=float)
    values.setflags(write=False)
    return values
