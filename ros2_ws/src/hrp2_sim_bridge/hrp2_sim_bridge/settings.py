"""How the world is simulated and how well the sensors measure, checked."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields

from door_impact_common.errors import SettingError

TICK = 0.005  # HRP-2's control period [s]
SAMPLE = 0.001  # of the log and the encoder [s]
SAMPLES_PER_TICK = round(TICK / SAMPLE)
SOLES = ("rigid", "rubber")
SHORTEST_STEP = 1e-5  # [s]
CONTACT_DURATIONS = (0.002, 0.1)  # [s]
MOST_ITERATIONS = 10_000


@dataclass(frozen=True)
class SensorSettings:
    """Noise and bias of the robot's sensors. The door's encoder has none but its steps.

    No figure of HRP-2's own sensors is at hand: each is assumed, of the size that such sensors
    have. Noise is white, a standard deviation per axis and sample; a bias is a standard deviation
    per axis over power-ons, constant from one to the next.

    Attributes:
        sensor_noise: False makes every sensor exact: joint velocities are not differences then,
            the attitude is not estimated, and the figures below do not count.
        force_sensor_calibrated: whether the offsets of the force sensors were taken away with
            the robot hanging in the air.
        force_noise: of a foot's force, a sample of 1 ms [N]; 0.1 % of a range of 1 kN.
        torque_noise: of a foot's torque, a sample of 1 ms [N m].
        force_bias: of a foot's force before the calibration [N].
        torque_bias: of a foot's torque before the calibration [N m].
        force_calibration_samples: of 1 ms whose mean is taken as the offset; 1000 last 1 s.
        gyro_noise: of an angular velocity, a sample of 5 ms [rad/s].
        gyro_bias: of an angular velocity before the calibration [rad/s].
        accelerometer_noise: of a specific force, a sample of 5 ms [m/s^2].
        accelerometer_bias: of a specific force [m/s^2]; nothing takes it away, and it tilts the
            attitude by bias / g: by 0.06 deg.
        imu_calibration_samples: of 5 ms, hanging still, whose means give the offset of the gyro
            and the first attitude; 2000 last 10 s.
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
        """Refuse what no sensor has.

        Raises:
            SettingError: with the setting, its value and its limit.
        """
        for one in fields(self):
            value = getattr(self, one.name)
            if isinstance(one.default, bool):
                if not isinstance(value, bool):
                    raise SettingError(one.name, value, "True or False")
            elif isinstance(one.default, int):
                if not isinstance(value, int) or isinstance(value, bool) or value < 1:
                    raise SettingError(one.name, value, "a whole number, 1 or more")
            elif not (math.isfinite(value) and value >= 0.0):
                raise SettingError(one.name, value, "a finite number, 0 or more")


@dataclass(frozen=True)
class WorldSettings:
    """How the world is simulated.

    Attributes:
        gui: show PyBullet's window.
        time_step_coarse: physics step [s], divides a millisecond.
        time_step_fine: the same while the robot is near the leaf [s].
        brace: whether braced joints may carry more than their motors.
        rotor_scale: multiple of the rotors' inertia, 0 for none.
        servo_time_constant: of the joints' servos [s]; None: the robot's own.
        restitution: of the leaf for two free masses; None: the door's own.
        contact_duration: of the impact that the leaf's surface is designed for [s].
        friction: between soles and floor.
        iterations: of the solver.
        seed: chooses the encoder's arbitrary zero and the noise of the sensors.
        encoder_bits: width of the door's counter, 16 or 32.
        log_seconds: length of motion that the log keeps [s].
        sensors: how well the robot's sensors measure.
        sole: "rubber" as `RobotConfig.sole_rubber` says, or "rigid".
        stabilizer: whether it runs on rubber; rigid soles need none.
    """

    gui: bool = False
    time_step_coarse: float = 0.0005
    time_step_fine: float = 0.00025
    brace: bool = True
    rotor_scale: float = 1.0
    servo_time_constant: float | None = None
    restitution: float | None = None
    contact_duration: float = 0.015
    friction: float = 0.8
    iterations: int = 50
    seed: int = 0
    encoder_bits: int = 16
    log_seconds: float = 600.0
    sensors: SensorSettings = field(default_factory=SensorSettings)
    sole: str = "rubber"
    stabilizer: bool = True

    @property
    def rubber(self) -> bool:
        """Whether the soles are of rubber."""
        return self.sole == "rubber"

    @property
    def stabilized(self) -> bool:
        """Whether the stabilizer runs."""
        return self.stabilizer and self.rubber

    def __post_init__(self) -> None:
        """Refuse what cannot be simulated.

        Raises:
            SettingError: with the setting, its value and its limit.
        """
        for name in ("time_step_coarse", "time_step_fine"):
            step = getattr(self, name)
            whole = math.isfinite(step) and SHORTEST_STEP <= step <= SAMPLE
            if not whole or abs(SAMPLE / step - round(SAMPLE / step)) > 1e-9:
                raise SettingError(name, step, f"a whole fraction of {SAMPLE} s")
        shortest, longest = CONTACT_DURATIONS
        if not shortest <= self.contact_duration <= longest:
            raise SettingError(
                "contact_duration", self.contact_duration, f"from {shortest:g} to {longest:g} s"
            )
        for name in ("friction", "log_seconds"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise SettingError(name, value, "a positive number")
        if not (math.isfinite(self.rotor_scale) and self.rotor_scale >= 0.0):
            raise SettingError("rotor_scale", self.rotor_scale, "0 or more")
        if self.servo_time_constant is not None and not (
            math.isfinite(self.servo_time_constant) and self.servo_time_constant > 0.0
        ):
            raise SettingError("servo_time_constant", self.servo_time_constant, "positive")
        if self.restitution is not None and not 0.0 <= self.restitution <= 1.0:
            raise SettingError("restitution", self.restitution, "0 to 1")
        if not 1 <= self.iterations <= MOST_ITERATIONS:
            raise SettingError("iterations", self.iterations, f"1 to {MOST_ITERATIONS}")
        if self.sole not in SOLES:
            raise SettingError("sole", self.sole, " or ".join(SOLES))
