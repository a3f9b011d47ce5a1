"""`<light>` elements."""

from __future__ import annotations

from typing import TYPE_CHECKING

from taskslam.errors import WorldError
from taskslam.geometry import FloatArray
from taskslam.world.gazebo.document import colour, text_of, vector
from taskslam.world.world import Light

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_TYPES = ("directional", "point", "spot")


def read_light(element: Element, T_world_light: FloatArray, where: str) -> Light | None:
    """The light at a pose, or None if it is switched off; raises WorldError for an unknown type."""
    name = (element.get("name") or "").strip()
    where = f"light '{name}' in {where}"
    kind = (element.get("type") or "point").strip()
    if kind not in _TYPES:
        raise WorldError(f"The type of {where} is '{kind}'; expected {', '.join(_TYPES)}.")
    if text_of(element, "light_on", "true") in ("0", "false"):
        return None
    intensity = max(vector(element, "intensity", (1.0,), where)[0], 0.0)
    r, g, b, _ = colour(element, "diffuse", (1.0, 1.0, 1.0, 1.0), where)
    dx, dy, dz = vector(element, "direction", (0.0, 0.0, -1.0), where)
    reach, constant, linear, quadratic = 10.0, 1.0, 0.0, 0.0
    attenuation = element.find("attenuation")
    if attenuation is not None:
        reach = vector(attenuation, "range", (10.0,), where)[0]
        constant = vector(attenuation, "constant", (1.0,), where)[0]
        linear = vector(attenuation, "linear", (1.0,), where)[0]
        quadratic = vector(attenuation, "quadratic", (0.0,), where)[0]
    return Light(
        name=name,
        type=kind,
        pose=T_world_light,
        direction=(dx, dy, dz),
        diffuse=(r * intensity, g * intensity, b * intensity),
        attenuation_range=reach,
        attenuation=(constant, linear, quadratic),
    )
