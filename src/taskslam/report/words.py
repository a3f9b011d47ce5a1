"""Numbers and outcomes in words, the same everywhere on the page. What is not defined is a dash."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

DASH = "–"
_OUTCOMES = {
    "reached": "reached",
    "no_plan": "no path to the goal",
    "no_control": "no safe motion found",
    "oscillation": "made no progress",
    "bumped": "bumped into something",
    "goal_timeout": "took too long",
    "crashed": "the method crashed",
    "stalled": "the method hung",
    "lost": "the method was lost or silent",
    "invalid_output": "the method gave an invalid pose",
    "not_seen": "not where it said it was",
    "unrecorded": "not reached, nobody recorded why",
}


def centimetres(metres: float | None) -> str:
    """Metres in centimetres with the decimals that matter."""
    if metres is None:
        return DASH
    value = metres * 100
    return f"{value:.0f}" if value >= 99.95 else f"{value:.1f}" if value >= 9.995 else f"{value:.2f}"


def whole_centimetres(metres: float) -> str:
    """Metres in whole centimetres, as a clearance is told."""
    return f"{100 * metres:.0f}" if math.isfinite(metres) else DASH


def length(metres: float) -> str:
    """A length in a sentence: centimetres below one metre, metres above."""
    return f"{centimetres(metres)} cm" if metres < 0.9995 else f"{metres:.2f} m"


def degrees(radians: float | None) -> str:
    """Radians in degrees."""
    return DASH if radians is None else f"{math.degrees(radians):.2f}"


def with_unit(text: str, unit: str) -> str:
    """A number with its unit; a dash stays alone."""
    return text if text == DASH else f"{text} {unit}"


def percent(share: float) -> str:
    """A share as a whole percentage; 100 only for all of it, 0 only for nothing."""
    return f"{share:.0%}"[:-1] if share in (0.0, 1.0) else str(min(max(round(100 * share), 1), 99))


def plain(value: float | None, digits: int) -> str:
    """A number with so many decimals."""
    return DASH if value is None else f"{value:.{digits}f}"


def minutes(seconds: float | None) -> str:
    """Seconds as minutes and seconds."""
    if seconds is None:
        return DASH
    whole, rest = divmod(round(seconds), 60)
    return f"{whole} min {rest:02d} s"


def ratio(value: float) -> str:
    """A ratio with the decimals that matter: 0.44, 3.2, 18, > 1000."""
    if value > 1000:
        return "> 1000"
    return f"{value:.2f}" if value < 2 else f"{value:.1f}" if value < 10 else f"{value:.0f}"


def hours(seconds: float) -> str:
    """Seconds as hours and minutes, or as minutes and seconds below an hour."""
    if seconds < 3600:
        return minutes(seconds)
    whole, rest = divmod(round(seconds / 60), 60)
    return f"{whole} h {rest:02d} min"


def count(number: int, what: str) -> str:
    """A number of things: `1 method`, `2 methods`."""
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def seeds(numbers: Collection[int]) -> str:
    """How many seeds a number rests on: `one seed`, `3 seeds`."""
    different = len(set(numbers))
    return "one seed" if different == 1 else f"{different} seeds"


def intervals_over(several_seeds: bool) -> str:
    """What intervals cover: with one seed, they say nothing of others."""
    return "over seeds, rounds and waypoints" if several_seeds else "over rounds and waypoints of one seed"


def mode(name: str) -> str:
    """A mode without its hyphen."""
    return name.replace("-", " ")


def outcome(name: str) -> str:
    """An outcome as a reader would say it."""
    return _OUTCOMES.get(name, name.replace("_", " "))


def outcomes(by_kind: Mapping[str, int]) -> str:
    """How often each outcome came, the most frequent first: `no path to the goal (3×), took too long (1×)`."""
    kinds = sorted(by_kind.items(), key=lambda item: (-item[1], item[0]))
    return ", ".join(f"{outcome(kind)} ({number}×)" for kind, number in kinds)
