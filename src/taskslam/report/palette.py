"""Colours that stay apart for colour-blind eyes: Okabe and Ito, "Color Universal Design" (2008).

Beyond seven, from Paul Tol's "muted" scheme; a method's marker then tells what its colour alone may not.
"""

from __future__ import annotations

BLACK = "#000000"
ORANGE = "#E69F00"
SKY = "#56B4E9"
GREEN = "#009E73"
BLUE = "#0072B2"
VERMILION = "#D55E00"
PURPLE = "#CC79A7"

TRUTH = BLUE
BELIEF = ORANGE  # where SLAM says that the robot is
CONTROL = GREEN
ESTIMATION = ORANGE
FAILURE = VERMILION

INK = "#1c2430"
MUTED = "#667085"
HAIRLINE = "#d9dde3"
TRACK = "#eef0f3"  # behind a bar: its full length
WALL = (64, 72, 86)
FREE = (255, 255, 255)

WINE = "#882255"
OLIVE = "#8A8B23"
INDIGO = "#332288"
TEAL = "#44AA99"
GREY = "#858B95"

# In this order; report/markers.py deals them out.
METHODS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK, WINE, OLIVE, INDIGO, TEAL, GREY)
