"""Reads the robot's configuration (config/robot.yaml) together with its URDF."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Annotated, Any, Generic, Literal, TypeVar

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.documents import Count, Name, Number, Part, Positive, Range, checked
from door_impact_common.errors import InputError, SettingError
from door_impact_common.yaml_files import read_yaml
from pydantic import AfterValidator, Field, model_validator

from hrp2_description.data import data_path
from hrp2_description.drives_and_pads import Brace, Drives, SoleRubber
from hrp2_description.errors import RobotConfigError
from hrp2_description.quantities import Length, in_metres
from hrp2_description.robot_types import (
    Arm,
    FootNames,
    FootSensors,
    Frame,
    Rect,
    RobotConfig,
    Step,
    StepLimits,
    WristSensor,
    needed,
)
from hrp2_description.urdf import Urdf, doubts, find_urdf

__all__ = [
    "RobotConfig", "StepLimits", "load_robot_config", "needed",
]

T = TypeVar("T")
SIDES = ("left", "right")  # the order of the sides in every array
LEG_JOINTS = 6  # number of joints of a leg
_KNEE = 3  # index of the knee among them
_BENT = math.radians(5.0)  # least bend of the knees in half-sitting
_LARGEST_INERTIA = 50.0  # rotor behind its gear [kg m^2]
_Names = tuple[Name, ...]


class _Sides(Part, Generic[T]):
    left: T
    right: T

    def mapping(self) -> Mapping[str, T]:
        return {"left": self.left, "right": self.right}


class _Row(Part):
    gear: tuple[Annotated[Number, Field(ge=1.0)], ...]
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


def _degrees(table: dict[Name, Any]) -> dict[Name, Any]:
    angles = np.abs(np.hstack([*table.values(), 0.0]))
    if angles.max() > 360.0:
        raise ValueError("angles up to 360 deg")
    if 0.0 < angles.max() <= math.pi:
        raise ValueError("degrees, and one of them above 3.2 (radians?)")
    return table


def _rectangle(sole: Rect) -> Rect:
    if not (sole[0] < sole[1] and sole[2] < sole[3]):
        raise ValueError("x_min, x_max, y_min, y_max, the lower one first")
    return in_metres(sole)


class _File(Part):
    """The fields of robot.yaml; that file says what they mean."""

    name: Name
    urdf: Name
    joint_names: _Names
    other_joints: Literal["fixed"] | None = None
    frames: dict[Name, Frame] = Field(default_factory=dict)
    legs: Annotated[_Sides[_Names], AfterValidator(_Sides.mapping)]
    arm: Arm
    step: Step
    footsteps: StepLimits | None = None
    chest_yaw: Name | None = None
    run_up_start: Annotated[Range, AfterValidator(in_metres)]
    half_sitting_deg: Annotated[dict[Name, tuple[Number, ...]], AfterValidator(_degrees)]
    drives: dict[Name, _Row] | None = None
    gear_sizes: dict[int, _GearSize] | None = None
    gear_damping_time: Positive | None = None
    motor_encoder_counts: Count | None = None
    sole: Annotated[tuple[Number, Number, Number, Number], AfterValidator(_rectangle)]
    sole_rubber: SoleRubber | None = None
    feet: Annotated[_Sides[FootNames], AfterValidator(_Sides.mapping)]
    foot_sensors: FootSensors = FootSensors()
    wrist_sensors: Annotated[_Sides[WristSensor], AfterValidator(_Sides.mapping)] | None = None
    imu_frame: Name | None = None
    contact_link: Name
    contact_radius: Length
    hand_link: Name
    hand_radius: Length | None = None
    clearance: Length = RobotConfig.clearance
    disabled_collisions: tuple[tuple[Name, Name], ...] = ()
    braced_posture_deg: Annotated[dict[Name, Number], AfterValidator(_degrees)]
    brace: Brace | None = None
    tucked_posture_deg: Annotated[dict[Name, Number], AfterValidator(_degrees)] | None = None
    braced_joints: _Names


# Fields that a file and a configuration have in the same form.
_SAME = {field.name for field in fields(RobotConfig)} & {*_File.model_fields} - {"drives"}


def load_robot_config(path: str | Path | None = None) -> RobotConfig:
    """Read the robot's configuration.

    The file must name all joints of the URDF in ``joint_names``. With ``other_joints: fixed`` the
    joints that it does not name, such as fingers, stay at zero.

    Args:
        path: YAML file in the form of config/robot.yaml, which is the default, or the name of a
            file beside that one without its ending, such as ``talos``. Its field ``urdf`` is a path
            relative to the file's folder, to the parent of that folder, or to this package's data;
            or it begins with ``package://`` and the name of a package that ROS or pip has
            installed.

    Raises:
        RobotConfigError: The file cannot be read, or a field is missing, unknown or unusable, or
            contradicts the URDF.
    """
    file = Path(data_path("config/robot.yaml") if path is None else path)
    if file.parent == Path() and not file.suffix:
        file = data_path(f"config/{file}.yaml")
    try:
        found = checked(_File, read_yaml(file))
        robot = _build(found, Urdf(find_urdf(found.urdf, file), found.frames))
        return robot if path is None else replace(robot, file=file.resolve())
    except SettingError as error:
        raise RobotConfigError(
            f"{file}: {error.setting}", value=error.value, limit=error.limit) from error
    except (InputError, ET.ParseError, KeyError, ValueError) as error:
        if isinstance(error, RobotConfigError):
            raise
        raise RobotConfigError(
            f"{file} cannot be used", value=str(error), limit="a robot.yaml with its URDF"
        ) from error


def _build(file: _File, urdf: Urdf) -> RobotConfig:
    names = file.joint_names
    limits = urdf.limits(names, file.other_joints)
    same = {name: getattr(file, name) for name in _SAME}
    x_min, x_max, y_min, y_max = file.sole
    config = RobotConfig(
        mass=urdf.mass(names),
        half_sitting=_frozen(
            np.deg2rad(_per_joint(file.half_sitting_deg, names, "half_sitting_deg"))
        ),
        lower=_frozen(limits[:, 0]),
        upper=_frozen(limits[:, 1]),
        velocity_limit=_frozen(limits[:, 2]),
        effort_limit=_frozen(limits[:, 3]),
        soles={"left": (x_min, x_max, -y_max, -y_min), "right": (x_min, x_max, y_min, y_max)},
        braced_posture=_radians(file.braced_posture_deg),
        tucked_posture=_radians(file.tucked_posture_deg or {}),
        urdf_file=urdf.path,
        urdf_path=urdf.written(names),
        root_link=urdf.tree[0][1],
        drives=_drives(file, names),
        doubts=(*doubts(urdf, names, limits, same["legs"]),
                *(["the force sensors of its feet are virtual: only the simulation has them"]
                  if file.foot_sensors.virtual else [])),
        **same,
    )
    _check_names(config, urdf)
    _check_chains(config)
    _check_postures(config)
    return config


def _radians(posture: dict[str, float]) -> Mapping[str, float]:
    return {name: math.radians(deg) for name, deg in posture.items()}


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
    inertia = columns["gear"] ** 2 * columns["rotor_inertia"]
    if inertia.max() > _LARGEST_INERTIA:
        raise RobotConfigError(
            f"rotor_inertia times gear^2 of {names[int(inertia.argmax())]} [kg m^2]",
            value=float(inertia.max()), limit=f"{_LARGEST_INERTIA:g} at most (kg cm^2?)")
    return Drives(
        gear_ratio=_frozen(columns["gear"]),
        rotor_inertia=_frozen(columns["rotor_inertia"]),
        damping=_frozen(needed(decay, "gear_damping_time") * gears["stiffness"]),
        position_gain=_frozen(columns["position_gain"]),
        speed_gain=_frozen(columns["speed_gain"]),
        **{key: _frozen(values) for key, values in gears.items()},
    )


def _check_names(config: RobotConfig, urdf: Urdf) -> None:
    named_links = [config.contact_link, config.hand_link, config.arm.wrist_link, config.imu_frame]
    named_links += [link for pair in config.disabled_collisions for link in pair]
    if config.brace is not None:
        named_links += [config.brace.arm.link, config.brace.trunk.link]
    named_joints: list[str | None] = [
        *config.braced_joints, *config.braced_posture, *config.tucked_posture, config.chest_yaw]
    for foot in config.feet.values():
        named_links += [foot.sole, foot.ankle]
        named_joints.append(foot.sensor_joint)
    for sensor in (config.wrist_sensors or {}).values():
        named_links.append(sensor.link)
        named_joints.append(sensor.joint)
    for what, named, known in (
            ("links", named_links, urdf.links), ("joints", named_joints, urdf.joints)):
        unknown = sorted({name for name in named if name is not None} - {*known})
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
        "tucked": config.posture(config.tucked_posture),
    }
    for leg in config.legs.values():
        knee = float(config.half_sitting[config.index(leg[_KNEE])])
        if abs(knee) < _BENT:
            raise RobotConfigError(
                f"half_sitting_deg of the knee {leg[_KNEE]}", value=round(math.degrees(knee), 3),
                limit=f"bent by {math.degrees(_BENT):.0f} deg or more (radians?)")
    for name, posture in postures.items():
        outside = (posture < config.lower) | (posture > config.upper)
        if outside.any():
            at = int(np.flatnonzero(outside)[0])
            raise RobotConfigError(
                f"{name} puts {config.joint_names[at]} outside its limits",
                value=float(posture[at]),
                limit=(float(config.lower[at]), float(config.upper[at])),
            )


def _per_joint(
    table: Mapping[str, Sequence[float]], names: tuple[str, ...], what: str
) -> Array:
    """Return the values of a table, (J,).

    Args:
        table: Values for the joints whose names have a common beginning, for example
            ``RLEG: [0, ...]``.
        names: Names of all joints.
        what: Name of the table for error messages.

    Raises:
        RobotConfigError: A beginning matches no joint, the number of values differs, or a joint
            has no value.
    """
    values: dict[str, float] = {}
    for beginning, row in table.items():
        joints = [name for name in names if name.startswith(beginning)]
        if not joints or len(row) != len(joints):
            raise RobotConfigError(
                f"{what} of {', '.join(joints) or f'{beginning}, which begins no joint name'}",
                value=row,
                limit=f"{len(joints)} values",
            )
        values |= zip(joints, row, strict=True)
    missing = [name for name in names if name not in values]
    if missing:
        raise RobotConfigError(
            f"{what} is missing for some joints", value=missing, limit="a value for each joint"
        )
    return np.array([float(values[name]) for name in names])


def _frozen(values: Array) -> Array:
    values = np.array(values, dtype=float)
    values.setflags(write=False)
    return values
