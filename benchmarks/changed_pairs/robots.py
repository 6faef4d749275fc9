"""The robots of the sets of pairs, as the concealed benchmark's simulator has them.

Numbers are those of the makers' manuals and robot descriptions; speed loops and heights of the centre of mass are
assumptions. The wheels' true track of the Warthog is the description's, not that of its data sheet in the package. A
limited torque is limited to the same share of every robot's; the label has that of the DDAGR.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from benchmarks.concealed.plant import Body, Plant
from ddagr_gym.errors import InputError

Values = Mapping[str, float]


@dataclass(frozen=True)
class SimulatedRobot:
    """What differs from the DDAGR in the simulator, and how sizes of effects grow with the robot.

    Attributes:
        body: fields of :class:`benchmarks.concealed.plant.Body`.
        wheels: of :class:`benchmarks.concealed.plant.Wheels`; the radius is the same at all four.
        motors: of :class:`benchmarks.concealed.plant.Motors`.
    """

    body: Values = field(default_factory=dict)
    wheels: Values = field(default_factory=dict)
    motors: Values = field(default_factory=dict)

    def put_into(self, plant: Plant) -> Plant:
        """The same field and frame with this robot on it."""
        wheels = {name: np.full(4, value) if name == "major_radius" else value for name, value in self.wheels.items()}
        return plant._replace(
            body=plant.body._replace(**self.body),
            wheels=plant.wheels._replace(**wheels),
            motors=plant.motors._replace(**self.motors),
        )

    def size_factor(self, effect: str) -> float:
        """Factor on the sizes of an effect: forces grow with the mass, lengths with the wheelbase.

        Args:
            effect: name.
        """
        mass = self.body.get("mass", Body().mass) / Body().mass
        if effect in ("payload", "towed_drag", "viscous_drag"):
            return mass
        if effect == "motor_droop":
            return 1.0 / mass
        if effect == "centre_of_mass_offset":
            return self.body.get("half_wheelbase", Body().half_wheelbase) / Body().half_wheelbase
        return 1.0


ROBOTS: dict[str, SimulatedRobot] = {
    "ddagr": SimulatedRobot(),
    "warthog": SimulatedRobot(
        body={"mass": 470.0, "inertia": 150.0, "half_wheelbase": 0.457, "half_track": 0.5655, "mass_height": 0.45},
        wheels={"minor_radius": 0.12, "half_width": 0.125, "major_radius": 0.178},
        motors={"rate_up": 6.0, "rate_down": 6.0, "inertia": 6.0, "carried_inertia": 21.0, "torque_limit": 900.0},
    ),
    "husky": SimulatedRobot(
        body={"mass": 75.0, "inertia": 5.0, "half_wheelbase": 0.256, "half_track": 0.2854, "mass_height": 0.2,
              "torsion": 5000.0, "soil_damping": 4000.0},
        wheels={"minor_radius": 0.05, "half_width": 0.05715, "major_radius": 0.1151},
        motors={"rate_up": 8.0, "rate_down": 8.0, "inertia": 0.5, "carried_inertia": 1.0, "torque_limit": 80.0},
    ),
}  # fmt: skip
"""By the name of their data sheet in the package."""


def simulated_robot(name: str) -> SimulatedRobot:
    """Robot of the sets by its name.

    Args:
        name: key of :data:`ROBOTS`.

    Raises:
        InputError: there is none of that name.
    """
    if name not in ROBOTS:
        raise InputError(f"There is no robot {name!r} among those of the pairs: give one of {', '.join(ROBOTS)}.")
    return ROBOTS[name]
