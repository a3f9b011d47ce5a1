"""Reading SDF and model.config XML: safe parsing, numbers and poses, with errors that name file and element."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from defusedxml import DefusedXmlException
from defusedxml import ElementTree as SafeXml

from taskslam.errors import WorldError
from taskslam.geometry import FloatArray, pose_from_xyz_rpy
from taskslam.world.gazebo.left_out import LeftOut

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_STRAY_AMPERSAND = re.compile(rb"&(?!(?:amp|lt|gt|quot|apos|#[0-9]+|#x[0-9a-fA-F]+);)")
_COMMENT = re.compile(rb"(<!\[CDATA\[.*?\]\]>)|<!--.*?-->", re.DOTALL)
_TWO_COLONS = re.compile(rb"(</?[A-Za-z_][\w.-]*)::(?=[\w.-])")
_PREFIX = re.compile(rb"(?:</?|\s)([A-Za-z_][\w.-]*):[\w.-]+(?=[\s=/>])")
_FIRST_TAG = re.compile(rb"<[A-Za-z_][\w.:-]*")
_PLACE = re.compile(r": line (\d+), column \d+$")
_XACRO = "ros.org/wiki/xacro}"

Rgba = tuple[float, float, float, float]
OLDEST_SDF, NEWEST_SDF = (1, 3), (1, 12)
SDF_VERSIONS = "1.3 to 1.12"


def lenient_xml(data: bytes) -> bytes:
    """The same document as a strict parser reads it too, line by line: what TinyXML2, which Gazebo uses, lets pass.

    Blanks before the declaration, `--` in comments (all comments go), bare `&`, bytes that are not UTF-8 (taken for
    Latin-1), prefixes that no one declares, names such as `gz::system_priority`.
    """
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):  # UTF-16 says so itself, and is well-formed or not
        return data
    declared = re.match(rb"\s*<\?xml[^>]*?encoding\s*=\s*[\"']([\w.-]+)", data.removeprefix(b"\xef\xbb\xbf"))
    if declared is None or declared[1].lower() in (b"utf-8", b"utf8"):
        try:
            data.decode("utf-8")
        except UnicodeDecodeError:
            data = data.decode("latin-1").encode("utf-8")
    data = data.removeprefix(b"\xef\xbb\xbf").lstrip()
    data = _COMMENT.sub(lambda found: found[1] or b"\n" * found[0].count(b"\n"), data)
    data = _STRAY_AMPERSAND.sub(b"&amp;", data)
    while b"::" in data and (joined := _TWO_COLONS.sub(rb"\1..", data)) != data:
        data = joined
    wanted = {prefix for prefix in _PREFIX.findall(data) if prefix not in (b"xml", b"xmlns")}
    unknown = [prefix for prefix in sorted(wanted) if b"xmlns:" + prefix not in data]
    declarations = b"".join(b' xmlns:%b="%b"' % (prefix, prefix) for prefix in unknown)
    return _FIRST_TAG.sub(lambda found: found[0] + declarations, data, count=1) if unknown else data


def parse_xml(data: bytes, path: Path) -> Element:
    """Root element of an XML document, read as `lenient_xml` says.

    Raises WorldError for malformed XML and for entities or external references, which no world needs and which are
    the means of entity bombs.
    """
    blank_lines = data[: len(data) - len(data.lstrip())].count(b"\n")
    try:
        root: Element = SafeXml.fromstring(lenient_xml(data))
    except DefusedXmlException as error:
        raise WorldError(f"{path} declares XML entities ({type(error).__name__}); a world must not.") from error
    except (SafeXml.ParseError, ValueError, LookupError) as error:
        place = _PLACE.search(str(error))
        if place is None:
            raise WorldError(f"{path} is not well-formed XML: {error}.") from error
        line, why = int(place[1]) + blank_lines, str(error)[: place.start()]
        if why == "duplicate attribute":
            why = "an element has the same attribute twice, which Gazebo refuses too"
        raise WorldError(f"{path} is not well-formed XML: line {line}: {why}.") from error
    return root


def parse_version(text: str | None) -> tuple[int, int] | None:
    """(major, minor) of an SDF version text such as `1.6`; None if it is not one."""
    parts = (text or "").strip().split(".")
    if len(parts) < 2 or not (parts[0].isdigit() and parts[1].isdigit()):
        return None
    return int(parts[0]), int(parts[1])


def parse_sdf(
    data: bytes, path: Path, left_out: LeftOut, expand: Callable[[Path], bytes | None] = lambda _: None
) -> Element:
    """Root `<sdf>` element of SDF 1.3 or newer; what is newer than 1.12 is tried, with a note.

    expand: gives the document without xacro's macros, or None where it cannot.

    Raises WorldError for another kind of file, an older one, and for macros that nobody has expanded.
    """
    root = parse_xml(data, path)
    if any(_XACRO in element.tag for element in root.iter()):
        plain = path.stem if path.suffix == ".xacro" else f"{path.stem}.expanded.sdf"
        if (expanded := expand(path)) is None:
            first = f"expand them first, xacro {path.name} > {plain} (pip install xacro, and it is done for you)"
            raise WorldError(f"{path} holds xacro macros: {first}")
        root = parse_xml(expanded, path)
        left_out.note(f"{path.name} holds xacro macros, which xacro expanded.")
    if root.tag == "robot":
        raise WorldError(f"{path} is a URDF: convert it first, gz sdf -p {path.name} > {path.stem}.sdf")
    if root.tag != "sdf":
        raise WorldError(f"{path} is not SDF: its root is <{root.tag}>, expected <sdf>.")
    text = root.get("version")
    version = parse_version(text)
    if version is not None and version < OLDEST_SDF:
        raise WorldError(f"{path} is SDF version {text!r}; expected {SDF_VERSIONS}.")
    if version is None or version > NEWEST_SDF:
        left_out.note(f"{path.name} is SDF version {text!r}: read as 1.12, the newest that is known.")
    _complete_positions(root, path, left_out)
    return root


def _complete_positions(root: Element, path: Path, left_out: LeftOut) -> None:
    """Poses of three numbers are positions without a rotation, as gazebo-classic reads them."""
    short = [pose for pose in root.iter("pose") if len((pose.text or "").split()) == 3]
    for pose in short:
        pose.text = f"{pose.text} 0 0 0"
    if short:
        left_out.note(
            f"{len(short)} of the poses in {path.name} have three numbers and are read as positions without a rotation"
            f" (first: {' '.join((short[0].text or '').split()[:3])})."
        )


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
