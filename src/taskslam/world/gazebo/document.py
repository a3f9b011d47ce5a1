"""Reading SDF and model.config XML: safe parsing, numbers and poses, with errors that name file and element."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from defusedxml import DefusedXmlException
from defusedxml import ElementTree as SafeXml

from taskslam.errors import WorldError
from taskslam.geometry import FloatArray, pose_from_xyz_rpy

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_STRAY_AMPERSAND = re.compile(rb"&(?!#?\w+;)")

Rgba = tuple[float, float, float, float]
OLDEST_SDF, NEWEST_SDF = (1, 4), (1, 11)


def parse_xml(data: bytes, path: Path) -> Element:
    """Root element of an XML document.

    Raises WorldError for malformed XML and for entities or external references, which no world needs and which are
    the means of entity bombs. A bare `&`, which published models hold and Gazebo's parser lets pass, is taken as text.
    """
    try:
        root: Element = SafeXml.fromstring(_STRAY_AMPERSAND.sub(b"&amp;", data))
    except DefusedXmlException as error:
        raise WorldError(f"{path} declares XML entities ({type(error).__name__}); a world must not.") from error
    except (SafeXml.ParseError, ValueError, LookupError) as error:
        raise WorldError(f"{path} is not well-formed XML: {error}.") from error
    return root


def parse_version(text: str | None) -> tuple[int, int] | None:
    """(major, minor) of an SDF version text such as `1.6`; None if it is not one."""
    parts = (text or "").strip().split(".")
    if len(parts) < 2 or not (parts[0].isdigit() and parts[1].isdigit()):
        return None
    return int(parts[0]), int(parts[1])


def parse_sdf(data: bytes, path: Path) -> Element:
    """Root `<sdf>` element; raises WorldError unless it is SDF 1.4 to 1.11."""
    root = parse_xml(data, path)
    if root.tag != "sdf":
        raise WorldError(f"{path} is not SDF: its root is <{root.tag}>, expected <sdf>.")
    version = parse_version(root.get("version"))
    if version is None or not OLDEST_SDF <= version <= NEWEST_SDF:
        raise WorldError(f"{path} is SDF version {root.get('version')!r}; versions 1.4 to 1.11 can be read.")
    return root


def text_of(element: Element, tag: str, default: str = "") -> str:
    """Stripped text of the first child `tag`, or the default where it is absent or empty."""
    return (element.findtext(tag) or "").strip() or default


def is_true(element: Element, tag: str, default: bool = False) -> bool:
    """Boolean child: `1` or `true`."""
    return text_of(element, tag, "1" if default else "0").lower() in ("1", "true")


def numbers(text: str | None, count: int, where: str) -> list[float]:
    """Exactly `count` finite numbers; raises WorldError otherwise."""
    try:
        values = [float(part) for part in (text or "").split()]
    except ValueError as error:
        raise WorldError(f"{where} holds {text!r}; expected {count} numbers.") from error
    if len(values) != count or not all(map(math.isfinite, values)):
        raise WorldError(f"{where} holds {text!r}; expected {count} finite numbers.")
    return values


def vector(element: Element, tag: str, default: tuple[float, ...], where: str) -> list[float]:
    """Numbers of a child, as many as the default has, or the default where the child is absent."""
    text = element.findtext(tag)
    return list(default) if text is None or not text.strip() else numbers(text, len(default), f"<{tag}> in {where}")


def colour(element: Element, tag: str, default: Rgba, where: str) -> Rgba:
    """RGBA in 0..1 of a child; alpha is 1 where only three numbers are given."""
    text = element.findtext(tag)
    if text is None or not text.strip():
        return default
    values = numbers(text, 3 if len(text.split()) == 3 else 4, f"<{tag}> in {where}")
    r, g, b, a = (min(max(v, 0.0), 1.0) for v in [*values, 1.0][:4])
    return r, g, b, a


def read_pose(element: Element, where: str) -> tuple[FloatArray, str]:
    """(4, 4) pose in the `<pose>` child and the frame that it is relative to (`""`: the default one).

    Angles are radians in fixed-axis roll, pitch, yaw, or degrees or a quaternion by the attributes of SDF 1.9. The
    attribute `frame` of SDF 1.5 and 1.6 is the older name of `relative_to`.
    """
    pose = element.find("pose")
    if pose is None:
        return np.eye(4), ""
    relative_to = (pose.get("relative_to") or pose.get("frame") or "").strip()
    if not (pose.text or "").strip():
        return np.eye(4), relative_to
    where = f"<pose> in {where}"
    if pose.get("rotation_format") == "quat_xyzw":
        values = numbers(pose.text, 7, where)
        return _pose_from_quaternion(values[:3], values[3:], where), relative_to
    values = numbers(pose.text, 6, where)
    angles = [math.radians(a) for a in values[3:]] if pose.get("degrees") in ("1", "true") else values[3:]
    return pose_from_xyz_rpy(values[:3], angles), relative_to


def _pose_from_quaternion(xyz: list[float], xyzw: list[float], where: str) -> FloatArray:
    norm = math.sqrt(sum(q * q for q in xyzw))
    if norm == 0.0:
        raise WorldError(f"{where} holds a zero quaternion; expected a rotation.")
    x, y, z, w = (q / norm for q in xyzw)
    T = np.eye(4)
    T[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    T[:3, 3] = xyz
    return T


def named(element: Element, tag: str) -> Iterator[tuple[str, Element]]:
    """Name and element of every direct child `tag`."""
    for child in element.findall(tag):
        yield (child.get("name") or "").strip(), child
