"""Colours that stay apart for colour-blind eyes: Okabe and Ito, "Color Universal Design" (2008).

Beyond seven, from Paul Tol's "muted" scheme; a method's marker then tells what its colour alone may not.
"""

from __future__ import annotations

PAPER = "#ffffff"
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
TINT = "#f5f6f8"  # behind a figure
WORD_OF_FAILURE = "#b84a00"  # as FAILURE, dark enough for small letters
MAGENTA = "#d6008f"
WALL = (64, 72, 86)
FREE = (255, 255, 255)

WINE = "#882255"
OLIVE = "#8A8B23"
INDIGO = "#332288"
TEAL = "#44AA99"
GREY = "#858B95"

# In this order; report/markers.py deals them out.
METHODS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK, WINE, OLIVE, INDIGO, TEAL, GREY)

# The colours of a page by name: on paper, and on a screen that prefers a dark ground.
PAGE = {
    "paper": (PAPER, "#14181f"),
    "ink": (INK, "#e6e9ee"),
    "muted": (MUTED, "#98a2b3"),
    "hairline": (HAIRLINE, "#353d49"),
    "track": (TRACK, "#29303b"),
    "tint": (TINT, "#1c222b"),
    "failure": (WORD_OF_FAILURE, "#ff9d66"),
    "black": (BLACK, "#f2f4f7"),
    "orange": (ORANGE, ORANGE),
    "sky": (SKY, "#7cc8f2"),
    "green": (GREEN, "#12b386"),
    "blue": (BLUE, "#3a8fd9"),
    "vermilion": (VERMILION, "#f0702a"),
    "purple": (PURPLE, PURPLE),
    "wine": (WINE, "#c2557f"),
    "olive": (OLIVE, "#a9aa35"),
    "indigo": (INDIGO, "#8576e6"),
    "teal": (TEAL, TEAL),
    "grey": (GREY, GREY),
    "magenta": (MAGENTA, "#f04db5"),
}
_NAMES = {light: name for name, (light, _) in PAGE.items()}


def on_page(colour: str) -> str:
    """A colour as a page writes it: by name, so that the style sheet may exchange it; one without a name as it is."""
    return f"var(--{_NAMES[colour]})" if colour in _NAMES else colour


def style_sheet() -> str:
    """Every colour of a page as a CSS variable. Paper stays light whatever the screen prefers."""
    light, dark = (" ".join(f"--{name}: {pair[ground]};" for name, pair in PAGE.items()) for ground in (0, 1))
    return (
        f":root {{ {light} }}\n@media screen and (prefers-color-scheme: dark) {{\n"
        f"  :root {{ color-scheme: dark; {dark} }}\n  .plan {{ filter: invert(0.92) hue-rotate(180deg); }}\n}}"
    )
