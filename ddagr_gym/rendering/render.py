"""Pictures of scenes: the field from above with a panel of numbers, by pygame-ce (the extra ``render``).

Importing this module does not import pygame. Without a window nothing touches the display: pictures are made in
memory, with no driver and no screen needed.
"""

from __future__ import annotations

import importlib
import os
from types import ModuleType
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.extras import how_to_install
from ddagr_gym.rendering import palette
from ddagr_gym.rendering.camera import Camera
from ddagr_gym.rendering.ground import Image, paint_ground
from ddagr_gym.rendering.panel import HEIGHT, WIDTH, Box, Drawing, Text, lay_out_panel
from ddagr_gym.rendering.ruts import RutMap
from ddagr_gym.rendering.scene import BedLayout, Scene, Stage, View
from ddagr_gym.rendering.sketch import Line, RobotSketch, dashes, dots, thin_out

Mode = Literal["rgb_array", "human"]
MODES = ("rgb_array", "human")

SMALLEST = (640, 480)
"""Smallest picture (width, height) in which the panel can be read [px]."""

LINE_WIDTH = 3.2
"""Of paths, at a picture height of 720 [px]."""

SUPERSAMPLING = 2
"""Pixels drawn per pixel shown, in each direction."""


def import_pygame() -> ModuleType:
    """The module ``pygame`` of pygame-ce, or an InputError that names the extra."""
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    pygame: ModuleType | None
    try:
        pygame = importlib.import_module("pygame")
        importlib.import_module("pygame.freetype")
    except ImportError:
        pygame = None
    # The older package pygame owns the same module name.
    if pygame is None or not getattr(pygame, "IS_CE", False):
        raise InputError(f"rendering needs pygame-ce, which is not installed: run {how_to_install('render')}.")
    return pygame


class SceneRenderer:
    """Draws scenes of drives.

    Args:
        size: of the picture, (width, height) [px].
        mode: "rgb_array" for pictures only, "human" to show each in a window too, in real time.
        frame_rate: pictures per second at most in the window.
        texture_seed: seed of the soil's and the plants' texture.

    Raises:
        InputError: a size too small to read, an unknown mode, pygame-ce absent, or no screen for "human".
    """

    def __init__(
        self,
        size: tuple[int, int] = (960, 720),
        mode: Mode = "rgb_array",
        *,
        frame_rate: float = 25.0,
        texture_seed: int = 0,
    ) -> None:
        if mode not in MODES:
            raise unknown_name("render mode", mode, MODES)
        width, height = (int(side) for side in size)
        if width < SMALLEST[0] or height < SMALLEST[1] or max(width, height) > 8192:
            least = f"{SMALLEST[0]} x {SMALLEST[1]}"
            raise InputError(f"picture of {width} x {height} px: give at least {least}, at most 8192 a side.")
        self.size, self.mode = (width, height), mode
        self._frame_rate, self._texture_seed = frame_rate, texture_seed
        self._pygame = import_pygame()
        self._pygame.freetype.init()
        self._font = self._pygame.freetype.Font(None, 12)
        self._font.origin = True
        self._lettering: dict[tuple[str, float, str, float], tuple[Any, Any, float]] = {}
        self._unit = height / HEIGHT
        self._field_width = width - round(WIDTH * self._unit)
        self._window = self._open_window() if mode == "human" else None
        self._stage: Stage | None = None
        self._painted: tuple[View, BedLayout | None, Image] | None = None
        self._closed = False

    def _open_window(self) -> tuple[Any, Any]:
        pygame = self._pygame
        try:
            pygame.display.init()
            window = pygame.display.set_mode(self.size)
        except pygame.error as error:
            raise InputError(f"no window can be opened ({error}): use render mode 'rgb_array'.") from None
        pygame.display.set_caption("ddagr-gym")
        return window, pygame.time.Clock()

    def _prepare(self, stage: Stage) -> None:
        """Paint what stays the same over a drive."""
        pygame, (width, height) = self._pygame, self.size
        self._camera = Camera(stage.view, SUPERSAMPLING * self._field_width, SUPERSAMPLING * height)
        # Episodes of the same turn share the painted field, which takes a third of a second.
        if self._painted is None or self._painted[:2] != (stage.view, stage.beds):
            rng = np.random.default_rng(self._texture_seed)
            self._painted = (stage.view, stage.beds, paint_ground(self._camera, stage.beds, rng))
        self._ruts = RutMap(self._camera, stage.robot, self._painted[2])
        self._robot = RobotSketch(pygame, self._camera, stage.robot)
        self._ground = pygame.Surface((self._camera.width, height * SUPERSAMPLING), depth=32)
        self._large = pygame.Surface((width * SUPERSAMPLING, height * SUPERSAMPLING), depth=32)
        self._picture = pygame.Surface(self.size, depth=32)
        self._copy_ground((slice(0, self._camera.height), slice(0, self._camera.width)))
        pixel = SUPERSAMPLING * self._unit
        path = [] if stage.target_path is None else [self._camera.pixels(stage.target_path)]
        pieces = [piece for whole in path for piece in dashes(whole, 15.0 * pixel, 9.0 * pixel)]
        self._target = Line(pieces, LINE_WIDTH * pixel, palette.rgb(palette.TARGET))
        self._stage = stage

    def _copy_ground(self, window: tuple[slice, slice]) -> None:
        pixels = self._pygame.surfarray.pixels3d(self._ground)
        pixels[window[1], window[0]] = self._ruts.image[window].swapaxes(0, 1)

    def draw(self, scene: Scene) -> NDArray[np.uint8]:
        """Picture of a scene, (height, width, 3); a new array each time. The same scene gives the same bytes.

        Raises:
            InputError: the renderer is closed, or the scene has more metric lines than fit.
        """
        if self._closed:
            raise InputError("this renderer is closed: make a new one.")
        panel = lay_out_panel(scene, float(self._field_width), self._unit)
        if scene.stage is not self._stage:
            self._prepare(scene.stage)
        for window in self._ruts.update(scene.track, scene.ruts):
            self._copy_ground(window)
        self._large.blit(self._ground, (0, 0))
        self._draw_paths(scene)
        self._robot.draw(self._large, scene.pose, scene.wheel_angle)
        self._draw_scale_bar(panel)
        self._draw_boxes(panel)
        for text in panel.texts:
            self._draw_text(text)
        self._pygame.transform.smoothscale(self._large, self.size, self._picture)
        self._show()
        pixels = np.frombuffer(self._pygame.image.tobytes(self._picture, "RGB"), np.uint8)
        return pixels.reshape(self.size[1], self.size[0], 3).copy()

    def _draw_paths(self, scene: Scene) -> None:
        pygame, pixel = self._pygame, SUPERSAMPLING * self._unit
        self._target.draw(pygame, self._large)
        track = self._camera.pixels(scene.track[:, :2])
        if np.ptp(track, axis=0).max() > 1.0:
            driven = Line([thin_out(track, 4.0 * pixel)], LINE_WIDTH * pixel, palette.rgb(palette.TRUE))
            driven.draw(pygame, self._large)
        if scene.estimated_track is not None and len(scene.estimated_track):
            for place in dots(self._camera.pixels(scene.estimated_track), 9.0 * pixel):
                pygame.draw.circle(self._large, palette.rgb(palette.HALO), place, 3.0 * pixel)
                pygame.draw.circle(self._large, palette.rgb(palette.ESTIMATE), place, 2.1 * pixel)

    def _draw_scale_bar(self, panel: Drawing) -> None:
        """A metre, lower right on the headland."""
        unit, length = self._unit, self._camera.scale / SUPERSAMPLING
        right, bottom = self._field_width - 24.0 * unit, self.size[1] - 24.0 * unit
        for x, y, width, height in (
            (right - length, bottom - 2.5 * unit, length, 2.5 * unit),
            (right - length, bottom - 9.0 * unit, 2.0 * unit, 9.0 * unit),
            (right - 2.0 * unit, bottom - 9.0 * unit, 2.0 * unit, 9.0 * unit),
        ):
            panel.boxes.append(Box(x, y, width, height, palette.INK))
        panel.texts.append(Text(right - length / 2.0, bottom - 9.0 * unit, "1 m", 13.0 * unit, align="centre"))

    def _draw_boxes(self, panel: Drawing) -> None:
        pygame, scale = self._pygame, SUPERSAMPLING
        self._large.fill(palette.rgb(palette.PAPER), (self._field_width * scale, 0, *self._large.get_size()))
        for box in panel.boxes:
            width, height = max(1, round(box.width * scale)), max(1, round(box.height * scale))
            if box.width * scale < 0.5:
                continue
            area = (round(box.x * scale), round(box.y * scale), width, height)
            pygame.draw.rect(self._large, palette.rgb(box.colour), area, border_radius=round(box.corner * scale))

    def _draw_text(self, text: Text) -> None:
        key = (text.content, text.size, text.colour, text.width)
        if key not in self._lettering:
            if len(self._lettering) > 400:
                self._lettering.clear()
            size = SUPERSAMPLING * text.size
            content = self._cut(text.content, size, SUPERSAMPLING * text.width)
            surface, bounds = self._font.render(content, palette.rgb(text.colour), size=size)
            self._lettering[key] = (surface, bounds, self._advance(content, size))
        surface, bounds, advance = self._lettering[key]
        shift = {"left": 0.0, "centre": 0.5, "right": 1.0}[text.align] * advance
        x, y = round(SUPERSAMPLING * text.x - shift), round(SUPERSAMPLING * text.y)
        self._large.blit(surface, (x + bounds.x, y - bounds.y))

    def _advance(self, content: str, size: float) -> float:
        """Width of a line of text [px], the space around its letters included."""
        return float(sum(metric[4] for metric in self._font.get_metrics(content, size=size)))

    def _cut(self, content: str, size: float, width: float) -> str:
        """The text, its end replaced by dots where it is longer than ``width`` pixels."""
        while len(content) > 1 and self._advance(content, size) > width:
            content = content.removesuffix("...")[:-1].rstrip() + "..."
        return content

    def _show(self) -> None:
        if self._window is None:
            return
        window, clock = self._window
        window.blit(self._picture, (0, 0))
        self._pygame.event.pump()
        self._pygame.display.flip()
        clock.tick(self._frame_rate)

    def close(self) -> None:
        """Close the window and free the pictures; may be called again."""
        if self._window is not None:
            self._pygame.display.quit()
        self._window, self._stage, self._painted, self._closed = None, None, None, True
