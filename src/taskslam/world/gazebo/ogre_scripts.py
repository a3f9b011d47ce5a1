"""Ogre material scripts: the few lines that say how a surface looks.

Source of the grammar: the OGRE manual, "Material Scripts". Read are the colours and the first texture of each material,
and inheritance; programs, filters and further textures are passed over.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

_PART = re.compile(r'"[^"]*"|[{}]|\n|[^\s{}"]+')
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)


@dataclass(frozen=True)
class OgreMaterial:
    """One material of a script. Colours are RGBA or None where the script is silent; scale as Ogre's `scale`."""

    name: str
    diffuse: tuple[float, ...] | None = None
    emissive: tuple[float, ...] | None = None
    specular: tuple[float, ...] | None = None
    texture: str | None = None
    scale: tuple[float, float] = (1.0, 1.0)


def parse_material_script(text: str) -> dict[str, OgreMaterial]:
    """The materials of a script by name. Broken scripts give what could be understood, as Ogre does."""
    materials: dict[str, OgreMaterial] = {}
    current: OgreMaterial | None = None
    depth = 0
    for line in _lines(_COMMENT.sub("", text)):
        if line == ["{"]:
            depth += 1
        elif line == ["}"]:
            depth = max(depth - 1, 0)
            if depth == 0 and current is not None:
                materials[current.name] = current
                current = None
        elif depth == 0 and line[0] == "material" and len(line) > 1:
            parent = line[line.index(":") + 1] if ":" in line[:-1] else None
            base = materials.get(parent) if parent else None
            current = replace(base, name=line[1]) if base else OgreMaterial(line[1])
        elif current is not None:
            current = _with_attribute(current, line)
    return materials


def _lines(text: str) -> Iterator[list[str]]:
    """Words line by line; braces stand alone."""
    words: list[str] = []
    for part in [*_PART.findall(text), "\n"]:
        if part in ("\n", "{", "}"):
            if words:
                yield words
            words = []
            if part in ("{", "}"):
                yield [part]
        else:
            words.append(part.strip('"'))


def _with_attribute(material: OgreMaterial, line: list[str]) -> OgreMaterial:
    keyword, arguments = line[0], line[1:]
    if keyword == "texture" and arguments and material.texture is None:
        return replace(material, texture=arguments[0])
    try:
        values = tuple(float(v) for v in arguments)
    except ValueError:
        return material
    if keyword == "scale" and len(values) == 2 and all(values):
        return replace(material, scale=(values[0], values[1]))
    if keyword in ("diffuse", "emissive", "specular") and len(values) >= 3:
        # specular ends with a shininess, which is not a colour
        colour = (*values[:3], values[3] if keyword == "diffuse" and len(values) > 3 else 1.0)
        return replace(material, **{keyword: colour})  # type: ignore[arg-type]
    return material
