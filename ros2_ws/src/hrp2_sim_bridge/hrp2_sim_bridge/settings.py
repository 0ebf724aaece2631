"""Settings of the simulation and its sensors: default, meaning and range of each in one place.

A field with a description is a parameter of the node. `World` takes the fields as keyword
arguments and checks them; the classes alone raise pydantic's errors.
"""

from __future__ import annotations

import math
from importlib.util import find_spec
from typing import Annotated, Any, Literal, get_args

from door_impact_common.documents import STRICT, Count, NotNegative, Number, Positive, number
from pydantic import AfterValidator, Field
from pydantic.dataclasses import dataclass
from robot_driver.trajectory_driver import PERIOD as TICK

SAMPLE = 0.001  # period of the log and of the door's encoder [s]
SAMPLES_PER_TICK = round(TICK / SAMPLE)
_EngineName = Literal["pybullet", "mujoco"]
_INSTALLED: _EngineName = "pybullet" if find_spec("pybullet") else "mujoco"
_Sole = Literal["rigid", "rubber"]
_Brace = Literal["contact", "rigid", "none"]
ENGINES, SOLES, BRACES = get_args(_EngineName), get_args(_Sole), get_args(_Brace)
FARTHEST = 10.0  # largest coordinate of the robot at the start, and of the door [m]
_SHORTEST_STEP = 1e-5  # shortest physics step [s]
_LONGEST_LOG = 86_400.0  # longest log, far more than a memory holds [s]
_WHOLE_TOLERANCE = 1e-9  # rounding error of a whole number of steps in a millisecond


def _divides_sample(step: float) -> float:
    steps = SAMPLE / step if _SHORTEST_STEP <= step <= SAMPLE else math.inf
    if not abs(steps - round(min(steps, 1e9))) <= _WHOLE_TOLERANCE:
        raise ValueError(f"a whole fraction of {SAMPLE} s, at least {_SHORTEST_STEP:g} s")
    return step


def _is_near(start: tuple[float, float, float]) -> tuple[float, float, float]:
    if not max(map(abs, start[:2])) <= FARTHEST:
        raise ValueError(f"x and y within {FARTHEST:g} m of the origin")
    return start


_Step = Annotated[Number, AfterValidator(_divides_sample)]
_Switch = Annotated[bool, Field(strict=True)]
_Start = Annotated[tuple[Number, Number, Number], AfterValidator(_is_near)]


def _setting(default: Any, text: str) -> Any:
    return Field(default, description=text)


@dataclass(frozen=True, config=STRICT)
class SensorSettings:
    """Noise and bias of the robot's sensors; the door's encoder has only its quantization.

    The figures of HRP-2's own sensors are not known to this project; all values are assumptions of
    the usual size. A noise is the standard deviation of white noise for each axis and sample. A
    bias is the standard deviation over power-ons for each axis; it is constant in between.

    Attributes:
        force_noise: Noise of a force in a sample of 1 ms [N]; 0.1 % of 1 kN.
        torque_noise: Noise of a torque in a sample of 1 ms [N m].
        force_bias: Bias of a force before the calibration [N].
        torque_bias: Bias of a torque before the calibration [N m].
        force_calibration_samples: Number of samples of 1 ms whose mean is the measured offset.
        gyro_noise: Noise of an angular velocity in a sample of 5 ms [rad/s].
        gyro_bias: Bias of an angular velocity before the calibration [rad/s].
        accelerometer_noise: Noise of a specific force in a sample of 5 ms [m/s^2].
        accelerometer_bias: Bias of a specific force, which tilts the attitude by bias / g [m/s^2].
        imu_calibration_samples: Number of samples of 5 ms at rest whose means are the gyro's
            offset and the first attitude.
    """

    sensor_noise: _Switch = _setting(
        True, "noise, bias and steps of joints, feet, wrists and IMU; false: they are exact")
    force_sensor_calibrated: _Switch = _setting(
        True, "false: the force sensors keep the offsets that they show in the air")
    force_noise: NotNegative = 1.0
    torque_noise: NotNegative = 0.03
    force_bias: NotNegative = 5.0
    torque_bias: NotNegative = 0.5
    force_calibration_samples: Count = 1000
    gyro_noise: NotNegative = 0.005
    gyro_bias: NotNegative = 0.01
    accelerometer_noise: NotNegative = 0.05
    accelerometer_bias: NotNegative = 0.01
    imu_calibration_samples: Count = 2000


@dataclass(frozen=True, config=STRICT)
class WorldSettings:
    """Settings of the simulation.

    Attributes:
        log: Whether a log is kept. Without one the memory does not grow.
        sensors: Noise and biases of the robot's sensors.
    """

    engine: _EngineName = _setting(_INSTALLED, "physics engine: pybullet or mujoco")
    gui: _Switch = _setting(False, "open the physics engine's window")
    time_step_coarse: _Step = _setting(0.0005, "physics step far from the leaf [s]")
    time_step_fine: _Step = _setting(0.00025, "physics step near the leaf [s]")
    brace: _Brace = _setting(
        "contact", "what the hitting arm leans on: contact (its pads), rigid (its joints are "
        "locked near the leaf), none")
    rotor_scale: Positive = _setting(1.0, "multiple of the rotors' inertia")
    gear_scale: Positive = _setting(1.0, "multiple of the gears' stiffness and damping")
    servo_scale: Positive = _setting(1.0, "multiple of the servos' gains")
    pad_scale: Positive = _setting(1.0, "multiple of the pads' stiffness and damping")
    restitution: float | None = number(
        None, 0.0, 1.0, "coefficient of restitution that the leaf shows to a free mass; negative, "
        "or None in Python: the door's own")
    contact_duration: float = number(
        0.015, 0.002, 0.1, "duration of the impact for which the leaf's surface is designed [s]")
    opens_to: float | None = number(
        None, 0.0, math.pi, "opening angle at which the leaf meets a bolt or a stop [rad]; 0: it "
        "is locked; negative, or None in Python: as far as the closer lets it")
    friction: Positive = _setting(0.8, "coefficient of friction between soles and floor")
    leaf_friction: NotNegative = _setting(0.3, "coefficient of friction between robot and leaf")
    iterations: int = Field(
        default=20, strict=True, ge=1, le=10_000,
        description="number of iterations of the engine's solver in each step")
    seed: int = _setting(0, "seed of the encoder's arbitrary zero and the sensors' noise")
    encoder_bits: Literal[16, 32] = _setting(16, "width of the door's counter, 16 or 32")
    log_seconds: float = number(
        600.0, TICK, _LONGEST_LOG,
        "duration that the log keeps, with 0.6 MB a second [s]; older rows are lost")
    sole: _Sole = _setting("rubber", "rubber as in robot.yaml, or rigid")
    servo: _Switch = _setting(
        False, "the joints follow a command in each control period, as below a controller of "
        "ros2_control (sim/joint_commands), instead of trajectories")
    playback_delay: int = Field(
        default=0, strict=True, ge=0, le=20,
        description="number of control periods by which a servo plays commands back late")
    stabilizer: _Switch = _setting(
        True, "keep the robot upright on rubber soles; rigid need none")
    rubber_scale: Positive = _setting(
        1.0, "multiple of the stiffness of the soles' rubber, unknown to the stabilizer")
    start: _Start = _setting(
        (0.0, 0.0, 0.0), "where the robot stands at first, and after a reset: x [m], y [m] and "
        "heading [rad] of the middle between the soles in odom; before a door hinged at the left "
        "the mirror image of this")
    log: bool = True
    sensors: SensorSettings = SensorSettings()

    @property
    def rubber(self) -> bool:
        """Whether the soles are of rubber."""
        return self.sole == "rubber"

    @property
    def stabilized(self) -> bool:
        """Whether the stabilizer runs."""
        return self.stabilizer and self.rubber
