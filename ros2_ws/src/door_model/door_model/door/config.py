"""Configurations of doors: YAML files are read, checked and written."""

import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeVar

from door_impact_common.documents import Name, Number, Part, Positive, Share, checked
from door_impact_common.errors import InputError, SettingError
from door_impact_common.files import shown
from door_impact_common.yaml_files import read_yaml, yaml_text

from door_model.checks import require_within
from door_model.data import data_path
from door_model.door.closer import FourBarCloser
from door_model.door.door import Door, Zone
from door_model.door.geometry import DoorGeometry, Frame, Hinge, Leaf
from door_model.errors import ConfigError, DeadCentreError, DoorModelError

WORKING_RANGE = math.pi / 2.0
"""Range of angles above the closed door [rad]: a closer by EN 1154 shuts its door from 90 deg."""

_STRONGEST = 500.0  # closer; the strongest size of EN 1154 has 140 N m [N m]
_ODD_INERTIA = 1.5  # factor on the moment of inertia of a uniform leaf that is improbable
_POSSIBLE = (5.0, 23000.0)  # densities, from foam to the densest metal [kg/m^3]
_DENSITIES = (30.0, 8000.0)  # of leaves, from honeycomb to steel [kg/m^3]
T = TypeVar("T", bound="_Geometry | _File")
_CLOSER = ("c_c", "k_c", "tau_c0_prime", "c_c_closing", "backcheck", "latch")


@dataclass(frozen=True)
class DoorConfig:
    """Configuration of a door.

    Attributes:
        name: Name of the door.
        leaf: The leaf.
        linkage: The closer's linkage.
        c_c: Viscosity at the closer's joint while the door opens [N m s/rad].
        k_c: Spring coefficient at the closer's joint [N m/rad].
        tau_c0_prime: Closer torque of eq. (12) [N m].
        i_a: Moment of inertia of the leaf about the hinge [kg m^2].
        restitution: Coefficient of restitution of a hit on the leaf, 0 to 1.
        c_c_closing: Viscosity while the door closes [N m s/rad]; None means that it is c_c.
        backcheck: Zone in which opening has another viscosity; None means that there is none.
        latch: Zone in which closing has another viscosity; None means that there is none.
        friction: Coulomb friction at the hinge [N m].
        frame: Frame and wall around the leaf; None means that nothing is known of them.
        hinge: Side of the hinge for somebody who is to push the door open.
    """

    name: str
    leaf: Leaf
    linkage: FourBarCloser
    c_c: float
    k_c: float
    tau_c0_prime: float
    i_a: float
    restitution: float
    c_c_closing: float | None = None
    backcheck: Zone | None = None
    latch: Zone | None = None
    friction: float = 0.0
    frame: Frame | None = None
    hinge: Hinge = "right"

    def door(self) -> Door:
        """Return the door of eq. (1)."""
        return Door(
            self.i_a, self.c_c, self.k_c, self.tau_c0_prime, self.linkage, self.c_c_closing,
            self.backcheck, self.latch, self.friction)

    def density(self) -> float:
        """Return the leaf's density [kg/m^3]."""
        return self.leaf.mass / (self.leaf.width * self.leaf.height * self.leaf.thickness)

    def doubts(self) -> tuple[str, ...]:
        """Return sentences about what is possible and improbable in the configuration."""
        found = []
        leaf, plate, limit = self.leaf, self.leaf.moment_of_inertia(), self.linkage.opening_limit()
        if not plate / _ODD_INERTIA < self.i_a < plate * _ODD_INERTIA:
            found.append(f"i_a is {self.i_a:.3g} kg m^2, that of a uniform leaf {plate:.3g}")
        if not _DENSITIES[0] < self.density() < _DENSITIES[1]:
            found.append(f"the leaf's density is {self.density():.3g} kg/m^3")
        if leaf.width > leaf.height:
            found.append(f"the leaf is {leaf.width:g} m wide and {leaf.height:g} m high")
        if self.backcheck is not None and self.backcheck.angle >= limit:
            found.append(f"the backcheck never acts: it begins at "
                         f"{math.degrees(self.backcheck.angle):.0f} deg, the linkage opens to "
                         f"{math.degrees(limit):.0f} deg")
        return tuple(found)

    def to_yaml(self) -> str:
        """Return YAML text that `load_door` reads back to the same numbers."""
        closer = {key: getattr(self, key) for key in _CLOSER}
        for zone in ("backcheck", "latch"):
            closer[zone] = closer[zone] and asdict(closer[zone])
        closer = {key: value for key, value in closer.items() if value is not None}
        document = {
            "name": self.name,
            "leaf": asdict(self.leaf),
            "linkage": asdict(self.linkage),
            "closer": closer,
            "i_a": self.i_a,
            "friction": self.friction,
            "restitution": self.restitution,
        }
        if self.frame is not None:
            document["frame"] = asdict(self.frame)
        if self.hinge != "right":
            document["hinge"] = self.hinge
        return yaml_text(document)


class _Closer(Part):
    c_c: Positive
    k_c: Positive
    tau_c0_prime: Number
    c_c_closing: Number | None = None
    backcheck: Zone | None = None
    latch: Zone | None = None


class _Geometry(Part):
    """The fields of a door that an identification needs; it may have those of `_File`."""

    name: Name
    leaf: Leaf
    linkage: FourBarCloser
    frame: Frame | None = None
    hinge: Hinge = "right"
    closer: Any = None
    restitution: Any = None
    i_a: Any = None
    friction: Any = None


class _File(_Geometry):
    """The fields of a door's file."""

    closer: _Closer
    restitution: Share
    i_a: Positive | None = None
    friction: Number = DoorConfig.friction


def door_names() -> list[str]:
    """Return the sorted names of the doors that come with this package."""
    return sorted(path.stem for path in data_path("doors").glob("*.yaml"))


def _names_file(name_or_path: str | Path) -> bool:
    """Return whether `load_door` takes its argument as a file, not as the name of a door."""
    text = str(name_or_path)
    return isinstance(name_or_path, Path) or "/" in text or text.endswith((".yaml", ".yml"))


def load_door(name_or_path: str | Path) -> DoorConfig:
    """Read the configuration of a door.

    A file has the keys of `doors/paper.yaml`. Without ``i_a`` the moment of inertia is that of a
    uniform leaf. A file may describe extensions of the paper's model (module
    `door_model.door.door`)::

        linkage: {..., assembly: -1}           # the mirrored mode
        closer:
          c_c_closing: 0.5                     # [N m s/rad] while the door closes
          backcheck: {angle: 1.22, c_c: 3.0}   # while it opens beyond 1.22 rad
          latch: {angle: 0.2, c_c: 0.1}        # while it closes below 0.2 rad
        friction: 0.3                          # [N m] at the hinge

    and the frame in which the leaf hangs (`door_model.door.geometry.Frame`)::

        frame:
          width: 0.90           # [m] between the jambs
          depth: 0.10           # [m] from the wall's face on the push side to the leaf's face
          wall_thickness: 0.14  # [m]
          threshold: 0.0        # [m], its height; 0 without this key

    and ``hinge: left`` where the hinge is at the left of who pushes the door open.

    Args:
        name_or_path: Name of a door of this package, such as "paper", or a YAML file.

    Raises:
        ConfigError: There is no such door, keys are unknown or missing, numbers are out of range,
            the leaf does not fit into the frame, or the closer cannot be assembled, does not pull
            the door shut, or has a dead centre within `WORKING_RANGE`.
    """
    source, document = _read(name_or_path)
    found = _checked(source, _File, document)
    config = DoorConfig(
        name=found.name,
        leaf=found.leaf,
        linkage=found.linkage,
        i_a=found.leaf.moment_of_inertia() if found.i_a is None else found.i_a,
        restitution=found.restitution,
        friction=found.friction,
        frame=found.frame,
        hinge=found.hinge,
        **{key: getattr(found.closer, key) for key in _CLOSER},
    )
    try:
        pull = float(config.door().restoring_torque(0.0))
        dead_centre = config.door().dead_centre()
        most = config.leaf.mass * config.leaf.width**2
        require_within("i_a", config.i_a, 0.0, most, "kg m^2, with all mass at the leaf's edge")
        require_within("density of the leaf", config.density(), *_POSSIBLE, "kg/m^3")
    except DoorModelError as error:
        raise ConfigError(source, str(error), value=error.value, limit=error.limit) from error
    if not config.friction < pull <= _STRONGEST:
        raise ConfigError(
            source,
            f"the closer's torque is {pull:.3g} N m at the closed door, with closer.tau_c0_prime "
            f"{config.tau_c0_prime:g}" + (
                "; N mm?" if pull > _STRONGEST else
                f": it does not pull the door shut against a friction of {config.friction:g} N m"),
            value=pull,
            limit=(config.friction, _STRONGEST),
        )
    if dead_centre is not None and dead_centre < WORKING_RANGE:
        cause = DeadCentreError(
            dead_centre,
            f"a closer must shut its door from {math.degrees(WORKING_RANGE):.0f} deg",
            value=WORKING_RANGE,
        )
        raise ConfigError(source, str(cause), value=dead_centre, limit=WORKING_RANGE) from cause
    return config


def load_geometry(name_or_path: str | Path) -> DoorGeometry:
    """Read leaf, linkage and frame of a door, without the parameters of its closer.

    The file may lack `closer`, `i_a` and `restitution`, like that of a door not yet identified.

    Args:
        name_or_path: Name of a door of this package or a YAML file.

    Raises:
        ConfigError: There is no such door, keys are unknown or missing, numbers are out of range,
            or the closer cannot be assembled.
    """
    source, document = _read(name_or_path)
    found = _checked(source, _Geometry, document)
    return DoorGeometry(found.name, found.leaf, found.linkage, found.frame, found.hinge)


def hinge_of(name_or_path: str) -> Hinge:
    """Read on which side a door's hinge is; without a name it is at the right.

    Raises:
        ConfigError: As of `load_geometry`.
    """
    return load_geometry(name_or_path).hinge if name_or_path else "right"


def _read(name_or_path: str | Path) -> tuple[str, Any]:
    """Return the name of a door or of its file for messages, and its YAML document."""
    text = str(name_or_path)
    source = shown(text)
    if not text:
        raise ConfigError("door", "no name and no file given", value=text, limit=door_names())
    if _names_file(name_or_path):
        path = Path(name_or_path)
    else:
        known = door_names()
        if text not in known:
            raise ConfigError(
                source, f"no such door; there are {', '.join(known)}", value=text, limit=known
            )
        path = data_path("doors") / f"{text}.yaml"
        source = str(path)
    try:
        return source, read_yaml(path)
    except InputError as error:
        raise ConfigError(
            source, error.problem, value=text, limit="a readable YAML file") from error


def _checked(source: str, kind: type[T], document: Any) -> T:
    """Return a document as what it describes; linkage and frame suit the closed door."""
    try:
        found = checked(kind, document)
        found.linkage.f(0.0)
        if found.frame is not None:
            found.frame.require_around(found.leaf)
        return found
    except (SettingError, DoorModelError) as error:
        raise ConfigError(source, str(error), value=error.value, limit=error.limit) from error
