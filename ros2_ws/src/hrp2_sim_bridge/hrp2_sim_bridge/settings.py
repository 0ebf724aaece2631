"""Settings of the simulation and of the sensors, with the checks of their ranges."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields

from door_impact_common.errors import SettingError

TICK = 0.005  # HRP-2's control period [s]
SAMPLE = 0.001  # period of the log and of the door's encoder [s]
SAMPLES_PER_TICK = round(TICK / SAMPLE)
ENGINES = ("pybullet", "mujoco")
SOLES = ("rigid", "rubber")
BRACES = ("contact", "rigid", "none")
_SCALES = ("rotor_scale", "gear_scale", "servo_scale", "pad_scale", "rubber_scale")
FARTHEST = 10.0  # largest coordinate of the robot at the start, and of the door [m]
SHORTEST_STEP = 1e-5  # shortest physics step [s]
CONTACT_DURATIONS = (0.002, 0.1)  # shortest and longest contact of robot and leaf [s]
_LONGEST_LOG = 86_400.0  # longest log, far more than a memory holds [s]
MOST_ITERATIONS = 10_000  # largest number of the solver's iterations
_WHOLE_TOLERANCE = 1e-9  # rounding error of a whole number of steps in a millisecond


@dataclass(frozen=True)
class SensorSettings:
    """Noise and bias of the robot's sensors; the door's encoder has only its quantization.

    The figures of HRP-2's own sensors are not known to this project; all values are assumptions of
    the usual size. A noise is the standard deviation of white noise for each axis and sample. A
    bias is the standard deviation over power-ons for each axis; it is constant in between.

    Attributes:
        sensor_noise: Whether the sensors have noise and bias. If not, every sensor is exact, joint
            velocities are no differences, the attitude is not estimated, and the other settings
            have no effect.
        force_sensor_calibrated: Whether the offsets of the force sensors were measured and
            subtracted while the robot hung in the air.
        force_noise: Noise of a foot's force in a sample of 1 ms [N]; 0.1 % of a range of 1 kN.
        torque_noise: Noise of a foot's torque in a sample of 1 ms [N m].
        force_bias: Bias of a foot's force before the calibration [N].
        torque_bias: Bias of a foot's torque before the calibration [N m].
        force_calibration_samples: Number of samples of 1 ms whose mean is the measured offset;
            1000 samples take 1 s.
        gyro_noise: Noise of an angular velocity in a sample of 5 ms [rad/s].
        gyro_bias: Bias of an angular velocity before the calibration [rad/s].
        accelerometer_noise: Noise of a specific force in a sample of 5 ms [m/s^2].
        accelerometer_bias: Bias of a specific force [m/s^2]. No calibration removes it, and it
            tilts the attitude by bias / g, 0.06 deg.
        imu_calibration_samples: Number of samples of 5 ms, with the robot hanging still, whose
            means are the gyro's offset and the first attitude; 2000 samples take 10 s.
    """

    sensor_noise: bool = True
    force_sensor_calibrated: bool = True
    force_noise: float = 1.0
    torque_noise: float = 0.03
    force_bias: float = 5.0
    torque_bias: float = 0.5
    force_calibration_samples: int = 1000
    gyro_noise: float = 0.005
    gyro_bias: float = 0.01
    accelerometer_noise: float = 0.05
    accelerometer_bias: float = 0.01
    imu_calibration_samples: int = 2000

    def __post_init__(self) -> None:
        """Check the settings.

        Raises:
            SettingError: A setting has a wrong type or is out of its range.
        """
        for setting in fields(self):
            value = getattr(self, setting.name)
            if isinstance(setting.default, bool):
                if not isinstance(value, bool):
                    raise SettingError(setting.name, value, "True or False")
            elif isinstance(setting.default, int):
                if not isinstance(value, int) or isinstance(value, bool) or value < 1:
                    raise SettingError(setting.name, value, "a whole number, 1 or more")
            elif not (math.isfinite(value) and value >= 0.0):
                raise SettingError(setting.name, value, "a finite number, 0 or more")


@dataclass(frozen=True)
class WorldSettings:
    """Settings of the simulation.

    Attributes:
        engine: Physics engine, "pybullet" or "mujoco".
        gui: Whether the simulator shows a window.
        time_step_coarse: Physics step far from the leaf [s]; a millisecond is a multiple of it.
        time_step_fine: Physics step near the leaf [s]; a millisecond is a multiple of it.
        brace: What the hitting arm leans on: "contact" means the pads of `robot.yaml`, "rigid"
            means that the braced joints are locked near the leaf, and "none" means nothing.
        rotor_scale: Multiple of the rotors' inertia.
        gear_scale: Multiple of the gears' stiffness and damping.
        servo_scale: Multiple of the servos' gains.
        pad_scale: Multiple of the pads' stiffness and damping.
        restitution: Coefficient of restitution that the leaf shows to a free mass; None means the
            door's own.
        contact_duration: Duration of the impact for which the leaf's surface is designed [s].
        friction: Coefficient of friction between soles and floor.
        leaf_friction: Coefficient of friction between robot and leaf; 0 is a smooth leaf.
        iterations: Number of the solver's iterations in each step.
        seed: Seed of the encoder's arbitrary zero and of the sensors' noise.
        encoder_bits: Width of the door's counter, 16 or 32.
        log: Whether a log is kept, of states and orders. Without one the memory does not grow.
        log_seconds: Duration of the motion that the log keeps [s]; a longer one loses the older
            half. Each simulated second needs 1.1 MB.
        sensors: Noise and biases of the robot's sensors.
        sole: "rubber", as in `RobotConfig.sole_rubber`, or "rigid".
        stabilizer: Whether the stabilizer runs on rubber soles; rigid soles need none.
        rubber_scale: Multiple of the stiffness of the soles' rubber, of which the stabilizer knows
            nothing.
        start: Where the robot stands at first: x [m], y [m] and heading [rad] of the middle between
            the soles in the world. The door's place does not depend on it.
    """

    engine: str = "pybullet"
    gui: bool = False
    time_step_coarse: float = 0.0005
    time_step_fine: float = 0.00025
    brace: str = "contact"
    rotor_scale: float = 1.0
    gear_scale: float = 1.0
    servo_scale: float = 1.0
    pad_scale: float = 1.0
    restitution: float | None = None
    contact_duration: float = 0.015
    friction: float = 0.8
    leaf_friction: float = 0.3
    iterations: int = 20
    seed: int = 0
    encoder_bits: int = 16
    log: bool = True
    log_seconds: float = 600.0
    sensors: SensorSettings = field(default_factory=SensorSettings)
    sole: str = "rubber"
    stabilizer: bool = True
    rubber_scale: float = 1.0
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def rubber(self) -> bool:
        """Whether the soles are of rubber."""
        return self.sole == "rubber"

    @property
    def stabilized(self) -> bool:
        """Whether the stabilizer runs."""
        return self.stabilizer and self.rubber

    def __post_init__(self) -> None:
        """Check the settings.

        Raises:
            SettingError: A setting is out of its range.
        """
        for name in ("time_step_coarse", "time_step_fine"):
            step = getattr(self, name)
            whole = math.isfinite(step) and SHORTEST_STEP <= step <= SAMPLE
            if not whole or abs(SAMPLE / step - round(SAMPLE / step)) > _WHOLE_TOLERANCE:
                raise SettingError(name, step, f"a whole fraction of {SAMPLE} s")
        shortest, longest = CONTACT_DURATIONS
        if not shortest <= self.contact_duration <= longest:
            raise SettingError(
                "contact_duration", self.contact_duration, f"from {shortest:g} to {longest:g} s"
            )
        for name in ("friction", "log_seconds", *_SCALES):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise SettingError(name, value, "a positive number")
        if self.log_seconds > _LONGEST_LOG:
            raise SettingError("log_seconds", self.log_seconds, f"at most {_LONGEST_LOG:g} s")
        if not (math.isfinite(self.leaf_friction) and self.leaf_friction >= 0.0):
            raise SettingError("leaf_friction", self.leaf_friction, "0 or more")
        if self.brace not in BRACES:
            raise SettingError("brace", self.brace, " or ".join(BRACES))
        if self.restitution is not None and not 0.0 <= self.restitution <= 1.0:
            raise SettingError("restitution", self.restitution, "0 to 1")
        if not 1 <= self.iterations <= MOST_ITERATIONS:
            raise SettingError("iterations", self.iterations, f"1 to {MOST_ITERATIONS}")
        if self.engine not in ENGINES:
            raise SettingError("engine", self.engine, " or ".join(ENGINES))
        if self.sole not in SOLES:
            raise SettingError("sole", self.sole, " or ".join(SOLES))
        self._check_start()

    def _check_start(self) -> None:
        start = tuple(map(float, self.start))
        if len(start) != 3 or not all(map(math.isfinite, start)):
            raise SettingError("start", self.start, "three finite numbers: x, y and heading")
        if max(map(abs, start[:2])) > FARTHEST:
            raise SettingError("start", self.start, f"within {FARTHEST:g} m of the origin")
        object.__setattr__(self, "start", start)  # a log has it as a list
