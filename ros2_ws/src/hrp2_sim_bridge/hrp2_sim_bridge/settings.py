"""Settings of the simulation and its sensors: default, meaning and range of each in one place."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple

from door_impact_common.errors import SettingError

TICK = 0.005  # HRP-2's control period [s]
SAMPLE = 0.001  # period of the log and of the door's encoder [s]
SAMPLES_PER_TICK = round(TICK / SAMPLE)
ENGINES = ("pybullet", "mujoco")
SOLES = ("rigid", "rubber")
BRACES = ("contact", "rigid", "none")
FARTHEST = 10.0  # largest coordinate of the robot at the start, and of the door [m]
SHORTEST_STEP = 1e-5  # shortest physics step [s]
_LONGEST_LOG = 86_400.0  # longest log, far more than a memory holds [s]
_MOST_ITERATIONS = 10_000
_WHOLE_TOLERANCE = 1e-9  # rounding error of a whole number of steps in a millisecond


class _Allowed(NamedTuple):
    """A check of a setting's value, and what it demands in words."""

    check: Callable[[Any], bool]
    words: str


def _one_of(names: tuple[str, ...]) -> _Allowed:
    return _Allowed(lambda value: value in names, " or ".join(names))


def _between(low: float, high: float, words: str) -> _Allowed:
    return _Allowed(lambda value: low <= value <= high, words)


def _divides_sample(step: float) -> bool:
    if not (math.isfinite(step) and SHORTEST_STEP <= step <= SAMPLE):
        return False
    return abs(SAMPLE / step - round(SAMPLE / step)) <= _WHOLE_TOLERANCE


def _is_start(start: Any) -> bool:
    return len(start) == 3 and all(map(math.isfinite, start)) and (
        max(map(abs, start[:2])) <= FARTHEST)


_POSITIVE = _Allowed(lambda value: math.isfinite(value) and value > 0.0, "a positive number")
_NOT_NEGATIVE = _Allowed(
    lambda value: math.isfinite(value) and value >= 0.0, "a finite number, 0 or more")
_SWITCH = _Allowed(lambda value: isinstance(value, bool), "True or False")
_COUNT = _Allowed(
    lambda value: isinstance(value, int) and not isinstance(value, bool) and value >= 1,
    "a whole number, 1 or more")
_STEP = _Allowed(_divides_sample, f"a whole fraction of {SAMPLE} s")
_ANY = _Allowed(lambda _: True, "")


def _setting(default: Any, text: str, allowed: _Allowed = _ANY) -> Any:
    """Return a field with what the setting means and which values it may have."""
    return field(default=default, metadata={"text": text, "allowed": allowed})


def _check(settings: Any) -> None:
    """Check each setting.

    Raises:
        SettingError: A setting has a wrong type or is out of its range.
    """
    for each in fields(settings):
        value, allowed = getattr(settings, each.name), each.metadata.get("allowed", _ANY)
        if not allowed.check(value):
            raise SettingError(each.name, value, allowed.words)


@dataclass(frozen=True)
class SensorSettings:
    """Noise and bias of the robot's sensors; the door's encoder has only its quantization.

    The figures of HRP-2's own sensors are not known to this project; all values are assumptions of
    the usual size. A noise is the standard deviation of white noise for each axis and sample. A
    bias is the standard deviation over power-ons for each axis; it is constant in between.

    Raises:
        SettingError: A setting has a wrong type or is out of its range.
    """

    sensor_noise: bool = _setting(
        True, "noise, bias and steps of joints, feet, wrists and IMU; false: they are exact",
        _SWITCH)
    force_sensor_calibrated: bool = _setting(
        True, "false: the force sensors keep the offsets that they show in the air", _SWITCH)
    force_noise: float = _setting(
        1.0, "noise of a force in a sample of 1 ms [N]; 0.1 % of 1 kN", _NOT_NEGATIVE)
    torque_noise: float = _setting(
        0.03, "noise of a torque in a sample of 1 ms [N m]", _NOT_NEGATIVE)
    force_bias: float = _setting(5.0, "bias of a force before the calibration [N]", _NOT_NEGATIVE)
    torque_bias: float = _setting(
        0.5, "bias of a torque before the calibration [N m]", _NOT_NEGATIVE)
    force_calibration_samples: int = _setting(
        1000, "number of samples of 1 ms whose mean is the measured offset", _COUNT)
    gyro_noise: float = _setting(
        0.005, "noise of an angular velocity in a sample of 5 ms [rad/s]", _NOT_NEGATIVE)
    gyro_bias: float = _setting(
        0.01, "bias of an angular velocity before the calibration [rad/s]", _NOT_NEGATIVE)
    accelerometer_noise: float = _setting(
        0.05, "noise of a specific force in a sample of 5 ms [m/s^2]", _NOT_NEGATIVE)
    accelerometer_bias: float = _setting(
        0.01, "bias of a specific force, which tilts the attitude by bias / g [m/s^2]",
        _NOT_NEGATIVE)
    imu_calibration_samples: int = _setting(
        2000, "number of samples of 5 ms at rest whose means are the gyro's offset and the first "
        "attitude", _COUNT)

    def __post_init__(self) -> None:
        """Check the settings."""
        _check(self)


@dataclass(frozen=True)
class WorldSettings:
    """Settings of the simulation.

    Raises:
        SettingError: A setting is out of its range.
    """

    engine: str = _setting("pybullet", "physics engine: pybullet or mujoco", _one_of(ENGINES))
    gui: bool = _setting(False, "open the physics engine's window")
    time_step_coarse: float = _setting(0.0005, "physics step far from the leaf [s]", _STEP)
    time_step_fine: float = _setting(0.00025, "physics step near the leaf [s]", _STEP)
    brace: str = _setting(
        "contact", "what the hitting arm leans on: contact (its pads), rigid (its joints are "
        "locked near the leaf), none", _one_of(BRACES))
    rotor_scale: float = _setting(1.0, "multiple of the rotors' inertia", _POSITIVE)
    gear_scale: float = _setting(1.0, "multiple of the gears' stiffness and damping", _POSITIVE)
    servo_scale: float = _setting(1.0, "multiple of the servos' gains", _POSITIVE)
    pad_scale: float = _setting(1.0, "multiple of the pads' stiffness and damping", _POSITIVE)
    restitution: float | None = _setting(
        None, "coefficient of restitution that the leaf shows to a free mass; negative, or None in "
        "Python: the door's own",
        _Allowed(lambda value: value is None or 0.0 <= value <= 1.0, "0 to 1"))
    contact_duration: float = _setting(
        0.015, "duration of the impact for which the leaf's surface is designed [s]",
        _between(0.002, 0.1, "from 0.002 to 0.1 s"))
    friction: float = _setting(0.8, "coefficient of friction between soles and floor", _POSITIVE)
    leaf_friction: float = _setting(
        0.3, "coefficient of friction between robot and leaf", _NOT_NEGATIVE)
    iterations: int = _setting(
        20, "number of iterations of the engine's solver in each step",
        _between(1, _MOST_ITERATIONS, f"1 to {_MOST_ITERATIONS}"))
    seed: int = _setting(0, "seed of the encoder's arbitrary zero and the sensors' noise")
    encoder_bits: int = _setting(
        16, "width of the door's counter, 16 or 32",
        _Allowed(lambda value: value in (16, 32), "16 or 32"))
    log_seconds: float = _setting(
        600.0, "duration that the log keeps, with 0.6 MB a second [s]; older rows are lost",
        _Allowed(lambda value: 0.0 < value <= _LONGEST_LOG,
                 f"a positive number, at most {_LONGEST_LOG:g} s"))
    sole: str = _setting("rubber", "rubber as in robot.yaml, or rigid", _one_of(SOLES))
    stabilizer: bool = _setting(True, "keep the robot upright on rubber soles; rigid need none")
    rubber_scale: float = _setting(
        1.0, "multiple of the stiffness of the soles' rubber, unknown to the stabilizer", _POSITIVE)
    start: tuple[float, float, float] = _setting(
        (0.0, 0.0, 0.0), "where the robot stands at first, and after a reset: x [m], y [m] and "
        "heading [rad] of the middle between the soles in odom",
        _Allowed(_is_start, f"three finite numbers, x and y within {FARTHEST:g} m of the origin"))
    log: bool = True
    """Whether a log is kept. Without one the memory does not grow."""
    sensors: SensorSettings = field(default_factory=SensorSettings)
    """Noise and biases of the robot's sensors."""

    @property
    def rubber(self) -> bool:
        """Whether the soles are of rubber."""
        return self.sole == "rubber"

    @property
    def stabilized(self) -> bool:
        """Whether the stabilizer runs."""
        return self.stabilizer and self.rubber

    def __post_init__(self) -> None:
        """Check the settings."""
        _check(self)
