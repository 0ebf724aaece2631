"""Configurations of doors: YAML files are read, checked and written."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import yaml
from door_impact_common.errors import InputError
from door_impact_common.files import shown
from door_impact_common.yaml_files import read_yaml

from door_model.data import data_path
from door_model.door.closer import FourBarCloser
from door_model.door.door import Door, Zone
from door_model.door.geometry import DoorGeometry, Leaf
from door_model.errors import ConfigError, DeadCentreError, DoorModelError

WORKING_RANGE = math.pi / 2.0
"""Range of angles above the closed door [rad]: a closer by EN 1154 shuts its door from 90 deg."""

_CLOSER_KEYS = ("c_c", "k_c", "tau_c0_prime")
_ZONES = ("backcheck", "latch")
_REQUIRED = ("name", "leaf", "linkage", "closer", "restitution")
_OPTIONAL = ("i_a", "friction")
_LINKAGE_KEYS = ("l", "l1", "l2", "l3", "theta_i0")


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

    def door(self) -> Door:
        """Return the door of eq. (1)."""
        return Door(
            self.i_a, self.c_c, self.k_c, self.tau_c0_prime, self.linkage, self.c_c_closing,
            self.backcheck, self.latch, self.friction)

    def geometry(self) -> DoorGeometry:
        """Return the leaf and the linkage only."""
        return DoorGeometry(self.name, self.leaf, self.linkage)

    def to_yaml(self) -> str:
        """Return YAML text that `load_door` reads back to the same numbers."""
        closer: dict[str, Any] = {key: getattr(self, key) for key in _CLOSER_KEYS}
        if self.c_c_closing is not None:
            closer["c_c_closing"] = self.c_c_closing
        closer |= {name: asdict(zone) for name in _ZONES if (zone := getattr(self, name))}
        document = {
            "name": self.name,
            "leaf": asdict(self.leaf),
            "linkage": asdict(self.linkage),
            "closer": closer,
            "i_a": self.i_a,
            "friction": self.friction,
            "restitution": self.restitution,
        }
        return yaml.safe_dump(document, sort_keys=False, allow_unicode=True)


def door_names() -> list[str]:
    """Return the sorted names of the doors that come with this package."""
    return sorted(path.stem for path in data_path("doors").glob("*.yaml"))


def names_file(name_or_path: str | Path) -> bool:
    """Return whether `load_door` takes its argument as a file, not as the name of a door."""
    text = str(name_or_path)
    return isinstance(name_or_path, Path) or "/" in text or text.endswith((".yaml", ".yml"))


def load_door(
    name_or_path: str | Path, folders: Sequence[Path] | None = None
) -> DoorConfig:
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

    Args:
        name_or_path: Name of a door of this package, such as "paper", or a YAML file.
        folders: Folders that may contain such a file, as for
            `door_impact_common.files.read_file`; None allows every folder.

    Raises:
        ConfigError: There is no such door, keys are unknown or missing, numbers are out of range,
            or the closer cannot be assembled, does not pull the door shut, or has a dead centre
            within `WORKING_RANGE`.
    """
    source, document = _read(name_or_path, folders)
    _check_keys(source, "", document, _REQUIRED, _OPTIONAL)
    geometry = _geometry(source, document)
    closer = _closer(source, document["closer"])
    restitution = _number(source, "restitution", document["restitution"])
    if not 0.0 <= restitution <= 1.0:
        raise _out_of_range(source, "restitution", restitution, "0 to 1")
    if "i_a" in document:
        i_a = _number(source, "i_a", document["i_a"])
    else:
        i_a = geometry.leaf.moment_of_inertia()
    for key in ("c_c", "k_c"):
        if not closer[key] > 0.0:
            raise _out_of_range(source, f"closer.{key}", closer[key], "a positive number")
    if not i_a > 0.0:
        raise _out_of_range(source, "i_a", i_a, "a positive number")
    config = DoorConfig(
        name=geometry.name,
        leaf=geometry.leaf,
        linkage=geometry.linkage,
        i_a=i_a,
        restitution=restitution,
        friction=_number(source, "friction", document.get("friction", 0.0)),
        **closer,
    )
    try:
        pull = float(config.door().restoring_torque(0.0))
        dead_centre = config.door().dead_centre()
    except DoorModelError as error:
        raise ConfigError(source, str(error), value=error.value, limit=error.limit) from error
    if not pull > 0.0:
        raise ConfigError(
            source,
            f"the closer does not pull the door shut: restoring torque {pull:.3g} N m at the "
            f"closed door, with closer.tau_c0_prime {config.tau_c0_prime:g}",
            value=pull,
            limit="a positive torque",
        )
    if dead_centre is not None and dead_centre < WORKING_RANGE:
        cause = DeadCentreError(
            dead_centre,
            f"a closer must shut its door from {math.degrees(WORKING_RANGE):.0f} deg",
            value=WORKING_RANGE,
        )
        raise ConfigError(source, str(cause), value=dead_centre, limit=WORKING_RANGE) from cause
    return config


def _closer(source: str, section: Any) -> dict[str, Any]:
    """Return the closer's parameters, including its zones."""
    if not isinstance(section, Mapping):
        raise ConfigError(
            source, "section 'closer' is not a mapping of keys", value=section, limit="a mapping")
    _check_keys(source, "closer", section, _CLOSER_KEYS, ("c_c_closing", *_ZONES))
    closer: dict[str, Any] = {
        key: _number(source, f"closer.{key}", section[key])
        for key in (*_CLOSER_KEYS, "c_c_closing")
        if key in section
    }
    for name in _ZONES:
        if name in section:
            numbers = _numbers(source, section, name, ("angle", "c_c"))
            try:
                closer[name] = Zone(**numbers)
            except DoorModelError as error:
                raise ConfigError(
                    source, f"{name}: {error}", value=error.value, limit=error.limit
                ) from error
    return closer


def load_geometry(
    name_or_path: str | Path, folders: Sequence[Path] | None = None
) -> DoorGeometry:
    """Read leaf and linkage of a door, without the parameters of its closer.

    The file may lack `closer`, `i_a` and `restitution`, like that of a door not yet identified.

    Args:
        name_or_path: Name of a door of this package or a YAML file.
        folders: As for `load_door`.

    Raises:
        ConfigError: There is no such door, keys are unknown or missing, numbers are out of range,
            or the closer cannot be assembled.
    """
    source, document = _read(name_or_path, folders)
    optional = ("closer", "restitution", *_OPTIONAL)
    _check_keys(source, "", document, ("name", "leaf", "linkage"), optional)
    return _geometry(source, document)


def _read(
    name_or_path: str | Path, folders: Sequence[Path] | None
) -> tuple[str, Mapping[str, Any]]:
    """Return the name of a door or of its file for messages, and its YAML document."""
    text = str(name_or_path)
    source = shown(text)
    if not text:
        raise ConfigError("door", "no name and no file given", value=text, limit=door_names())
    if names_file(name_or_path):
        path = Path(name_or_path)
    else:
        known = door_names()
        if text not in known:
            raise ConfigError(
                source, f"no such door; there are {', '.join(known)}", value=text, limit=known
            )
        path, folders = data_path("doors") / f"{text}.yaml", None
        source = str(path)
    try:
        document = read_yaml(path, folders)
    except InputError as error:
        raise ConfigError(
            source, error.problem, value=text, limit="a readable YAML file") from error
    if not isinstance(document, Mapping):
        raise ConfigError(source, "is not a mapping of keys", value=document, limit="a mapping")
    return source, document


def _check_keys(
    source: str,
    section: str,
    document: Mapping[str, Any],
    required: tuple[str, ...],
    optional: tuple[str, ...] = (),
) -> None:
    """Raise ConfigError for a missing or an unknown key.

    Missing keys come first: only of a file with a door's keys is a word in the message.
    """
    where = f"section {section!r}: " if section else ""
    missing = [key for key in required if key not in document]
    if missing:
        raise ConfigError(
            source, f"{where}missing {', '.join(missing)}", value=missing, limit=required
        )
    known = (*required, *optional)
    unknown = [str(key) for key in document if key not in known]
    if unknown:
        raise ConfigError(
            source,
            f"{where}unknown {shown(', '.join(unknown))}; known are {', '.join(known)}",
            value=unknown,
            limit=known,
        )


def _numbers(
    source: str,
    document: Mapping[str, Any],
    section: str,
    keys: tuple[str, ...],
    optional: tuple[str, ...] = (),
) -> dict[str, float]:
    """Read a section that consists of numbers."""
    content = document[section]
    if not isinstance(content, Mapping):
        raise ConfigError(
            source, f"section {section!r} is not a mapping of keys", value=content,
            limit="a mapping")
    _check_keys(source, section, content, keys, optional)
    return {
        key: _number(source, f"{section}.{key}", content[key])
        for key in (*keys, *optional)
        if key in content
    }


def _number(source: str, key: str, value: Any) -> float:
    """Return a value that must be a finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise _out_of_range(source, key, value, "a finite number")
    return float(value)


def _out_of_range(source: str, key: str, value: Any, limit: str) -> ConfigError:
    """Return the error for a value that is out of range."""
    found = value if isinstance(value, int | float | None) else f"a {type(value).__name__}"
    return ConfigError(source, f"{key} must be {limit}, not {found}", value=value, limit=limit)


def _geometry(source: str, document: Mapping[str, Any]) -> DoorGeometry:
    """Return leaf and linkage of a document, which must close at the closed door."""
    name = document["name"]
    if not isinstance(name, str) or not name:
        raise ConfigError(
            source, "name must be a text that is not empty", value=name, limit="a text")
    leaf_keys = tuple(field.name for field in fields(Leaf))
    try:
        leaf = Leaf(**_numbers(source, document, "leaf", leaf_keys))
        linkage = FourBarCloser(
            **_numbers(source, document, "linkage", _LINKAGE_KEYS, ("assembly",)))
        linkage.f(0.0)
    except ConfigError:
        raise
    except DoorModelError as error:
        raise ConfigError(source, str(error), value=error.value, limit=error.limit) from error
    return DoorGeometry(name, leaf, linkage)
