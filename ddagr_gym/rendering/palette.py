"""Colours of figures and video: the colour-blind-safe set of M. Okabe and K. Ito (2008), soil and paper tones."""

from __future__ import annotations

Colour = tuple[int, int, int]


def rgb(code: str) -> Colour:
    """(red, green, blue), 0 to 255, of "#rrggbb"."""
    return int(code[1:3], 16), int(code[3:5], 16), int(code[5:7], 16)


ORANGE = "#E69F00"
SKY_BLUE = "#56B4E9"
GREEN = "#009E73"
BLUE = "#0072B2"
VERMILLION = "#D55E00"
PALE_ORANGE = "#F6CF86"
PURPLE = "#CC79A7"

INK = "#22262A"
GREY = "#6E757C"
PALE = "#C9CDD1"
HAIRLINE = "#E3E5E7"
PAPER = "#FFFFFF"
SHADE = "#F3F1EB"
BED = "#E5E1D8"
HALO = "#FBF8F2"


TARGET = BLUE
TRUE = VERMILLION
ESTIMATE = INK
RIGHT = BLUE
LEFT = ORANGE
"""The same quantity has the same colour in every figure and in the video."""

HEADLAND_SOIL = "#C8B597"
FURROW_SOIL = "#B39E82"
PRESSED_SOIL = "#6F553E"
MULCH = "#3A3D40"
LEAVES = ("#557D44", "#628C4F", "#48703C", "#729B5C")

SIDE_WALL = "#17181A"
TYRE = "#2A2B2D"
TREAD = "#4B4D50"
AXLE = "#5B6066"
FRAME = "#8D949A"
DECK = "#F4F2EC"
DECK_EDGE = "#A9AFB4"
