"""World to pixels: fixed camera from above, x to the right and y up."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.rendering.scene import View

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """Camera that shows a view as large as it fits into ``width`` x ``height`` pixels, in the middle."""

    view: View
    width: int
    height: int

    @cached_property
    def scale(self) -> float:
        """Pixels per metre."""
        view = self.view
        return min(self.width / (view.x_max - view.x_min), self.height / (view.y_max - view.y_min))

    @cached_property
    def origin(self) -> tuple[float, float]:
        """Pixel of the world origin."""
        view = self.view
        x_middle, y_middle = (view.x_min + view.x_max) / 2.0, (view.y_min + view.y_max) / 2.0
        return self.width / 2.0 - self.scale * x_middle, self.height / 2.0 + self.scale * y_middle

    def pixels(self, points: ArrayLike) -> Array:
        """Pixel coordinates (..., 2), right and down, of world points (..., 2) [m]."""
        return np.asarray(self.origin) + np.asarray(points, dtype=float) * (self.scale, -self.scale)

    def columns_x(self) -> Array:
        """World x of the pixel columns' middles (width,) [m]."""
        return np.asarray((np.arange(self.width) + 0.5 - self.origin[0]) / self.scale, dtype=float)

    def rows_y(self) -> Array:
        """World y of the pixel rows' middles (height,) [m]."""
        return np.asarray((self.origin[1] - np.arange(self.height) - 0.5) / self.scale, dtype=float)
