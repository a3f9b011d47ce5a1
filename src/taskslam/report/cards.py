"""What a method's card says, in a reader's words. A card that lacks a field says nothing about it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from taskslam.report.words import DASH
from taskslam.sensors import main_of, sensor_words

_KINDS = {"slam": "SLAM", "odometry": "odometry", "localization": "localisation", "reference": "reference"}
_MAPS = {"continue": "keeps mapping", "frozen": "frozen map", "none": "no map"}


def sensor_suite(card: Mapping[str, Any]) -> str:
    """The sensors that a method listens to."""
    return " + ".join(sensor_words(str(name)) for name in _list(card, "sensors")) or DASH


def main_sensor(card: Mapping[str, Any]) -> str:
    """The sensor that a method sees with, as cards name it; empty if the card names none."""
    return main_of([str(name) for name in _list(card, "sensors")])


def sensor_name(sensor: str) -> str:
    """A sensor of a card in a reader's words."""
    return sensor_words(sensor)


def kind(card: Mapping[str, Any]) -> str:
    """SLAM, odometry, localisation, or a reference."""
    return _KINDS.get(str(card.get("kind")), str(card.get("kind") or DASH))


def map_mode(card: Mapping[str, Any]) -> str:
    """What the method does with its map in rounds with map (protocol 7.3 #13)."""
    return _MAPS.get(str(card.get("map_mode")), str(card.get("map_mode") or DASH))


def yes_or_no(card: Mapping[str, Any], field: str) -> str:
    """A flag of the card."""
    value = card.get(field)
    return DASH if value is None else "yes" if value else "no"


def latency(card: Mapping[str, Any]) -> str:
    """The latency on the card, which `fixed` runs use."""
    value = card.get("latency")
    return f"{1000 * value:g} ms" if isinstance(value, int | float) else DASH


def known_limits(card: Mapping[str, Any]) -> list[str]:
    """What a reader must know before comparing this method with another."""
    limits = []
    if card.get("kind") == "odometry":
        limits.append("odometry only")
    if card.get("kind") == "reference":
        limits.append("reference: is told the truth")
    if card.get("kind") == "localization":
        limits.append("localises in a given map")
    if card.get("map_mode") == "none" and card.get("kind") != "reference":
        limits.append("no map reuse")
    if card.get("map_mode") == "frozen":
        limits.append("map frozen after the priming round")
    if card.get("deterministic") is False:
        limits.append("not deterministic")
    if card.get("odometry_prior"):
        limits.append("uses wheel odometry as prior")
    if optional := _list(card, "optional_sensors"):
        limits.append(f"uses {' + '.join(sensor_words(str(name)) for name in optional)} as prior where there is one")
    if card.get("loopback"):
        limits.append("network open (TCP)")
    if card.get("shared_memory"):
        limits.append("has shared memory")
    if reads := _list(card, "reads"):
        limits.append(f"reads {', '.join(map(str, reads))}")
    still = card.get("needs_still_start")
    if isinstance(still, int | float) and still > 0:
        limits.append(f"stands still {still:g} s first")
    if _is_gpl(str(card.get("licence", ""))):
        limits.append("GPL")
    return [*limits, *(str(limit) for limit in _list(card, "limits"))]


def _list(card: Mapping[str, Any], field: str) -> Sequence[Any]:
    """A list of the card; a manifest from elsewhere may hold anything there."""
    value = card.get(field)
    return value if isinstance(value, list | tuple) else ()


def _is_gpl(licence: str) -> bool:
    return "GPL" in licence.upper() and "LGPL" not in licence.upper()
