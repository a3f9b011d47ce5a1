"""Lens models by the many names that tools give them: one place for calibrations in files, folders and messages.

What a model's numbers say counts, not how many there are: zeros behind the last coefficient are none. A model without
coefficients, or a radial one with zeros alone, is an ideal lens; an equidistant one with zeros is not (r = theta).
"""

from __future__ import annotations

from collections.abc import Sequence

from taskslam.errors import DatasetError

NONE, RADIAL, EQUIDISTANT = "none", "radial-tangential", "equidistant"

DISTORTION_MODELS = {NONE: (0,), RADIAL: (4, 5, 8), EQUIDISTANT: (4,)}
"""Models with the numbers of coefficients that `lens` gives: k1 k2 p1 p2 [k3 [k4 k5 k6]], and k1 to k4."""

_LENGTHS = {NONE: tuple(range(15)), RADIAL: (0, 4, 5, 8, 12, 14), EQUIDISTANT: (0, 4)}  # as files have them
_ALIASES = {
    "": RADIAL,
    "none": NONE,
    "radtan": RADIAL,
    "plumb_bob": RADIAL,
    "rational_polynomial": RADIAL,
    "radial-tangential": RADIAL,
    "radialtangential": RADIAL,
    "brown": RADIAL,
    "equi": EQUIDISTANT,
    "equidistant": EQUIDISTANT,
    "fisheye": EQUIDISTANT,
    "kannala_brandt": EQUIDISTANT,
}


def lens(name: str, coefficients: Sequence[float], where: str) -> tuple[str, tuple[float, ...]]:
    """One of `DISTORTION_MODELS` and its coefficients, of a model by any of its names.

    Raises DatasetError: a model that is not read (omni, fov, ds, thin prism, tilted sensor), or too many coefficients.
    """
    key = name.strip().lower().replace(" ", "_")
    model = _ALIASES.get(key, _ALIASES.get(key.replace("_", "-")))
    if model is None:
        known = ", ".join(sorted(_ALIASES.keys() - {""}))
        raise DatasetError(f"{where}: distortion model '{name}'; expected one of {known}")
    values = tuple(float(value) for value in coefficients)
    if len(values) not in _LENGTHS[model]:
        expected = " or ".join(map(str, _LENGTHS[model]))
        raise DatasetError(
            f"{where}: {len(values)} coefficients for the distortion model '{name}'; expected {expected}"
        )
    count = max((at for at, value in enumerate(values, start=1) if value != 0.0), default=0)
    if model == EQUIDISTANT and values:
        count = max(count, 1)
    if count == 0 or model == NONE:
        if count:
            raise DatasetError(f"{where}: distortion model 'none' with {count} coefficients that are not zero")
        return NONE, ()
    fitting = [length for length in DISTORTION_MODELS[model] if length >= count]
    if not fitting:
        raise DatasetError(f"{where}: {count} coefficients: thin prisms or a tilted sensor, which are not read")
    return model, (*values[:count], *(0.0,) * (fitting[0] - count))
