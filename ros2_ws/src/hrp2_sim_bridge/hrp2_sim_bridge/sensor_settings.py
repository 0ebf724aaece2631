"""How well the simulated robot's sensors measure."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from hrp2_sim_bridge.errors import SettingError


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
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(field.default, bool):
                if not isinstance(value, bool):
                    raise SettingError(field.name, value, "True or False")
            elif isinstance(field.default, int):
                if not isinstance(value, int) or isinstance(value, bool) or value < 1:
                    raise SettingError(field.name, value, "a whole number, 1 or more")
            elif not (math.isfinite(value) and value >= 0.0):
                raise SettingError(field.name, value, "a finite number, 0 or more")
