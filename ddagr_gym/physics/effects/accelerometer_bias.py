"""An accelerometer that reads something where nothing pushes."""

from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.layout import POINT_READINGS, READING


def shift_accelerometer(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Add ``parameters[:2]`` to the specific force that is read."""
    row[READING] += parameters[0]
    row[READING + 1] += parameters[1]


@dataclass(frozen=True)
class AccelerometerBias(Effect):
    """Constants added to the specific force that is read.

    Attributes:
        x: least: 0.05 m/s^2, a tenth of the data sheet's tolerance and as much as 0.3 degrees of tilt.
        y: least: the same.
    """

    name = "accelerometer_bias"
    title = "Accelerometer bias"
    group = "sensors"
    equation = "specific force reading + (x, y)"
    source = "IEEE Std 1293-2018 (accelerometer error model); MPU-6050 data sheet: +-50 mg zero-g output"
    signature = "specific force shifted by the same amount at rest, in motion and at every heading"
    confused_with = ("imu_tilt", "slope")
    actions = ((POINT_READINGS, shift_accelerometer),)

    x: float = size("m/s^2", -5.0, 5.0, least=0.05)
    y: float = size("m/s^2", -5.0, 5.0, least=0.05, default=0.0)
