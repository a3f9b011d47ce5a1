"""The `<material>` of a visual: script, PBR or plain colours, applied to a surface."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from taskslam.world.gazebo.document import colour, text_of, vector
from taskslam.world.gazebo.left_out import LeftOut
from taskslam.world.gazebo.ogre_scripts import OgreMaterial, parse_material_script
from taskslam.world.gazebo.resources import Resources
from taskslam.world.gazebo.stock_materials import stock_material
from taskslam.world.gazebo.surfaces import Surface
from taskslam.world.gazebo.textures import TextureStore
from taskslam.world.world import Material

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_WHITE = (1.0, 1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Look:
    """A material and how its texture lies: `repeat` times over 0..1, or once in `tile` metres where that is above 0."""

    material: Material
    repeat: tuple[float, float] = (1.0, 1.0)
    tile: float = 0.0

    def on(self, surface: Surface) -> Surface:
        """The surface with this look; its texture coordinates include the repeats."""
        if self.tile > 0.0 and surface.metres is not None:
            return replace(surface, material=self.material, uv=surface.metres / self.tile)
        return replace(surface, material=self.material, uv=surface.uv * np.array(self.repeat))


@dataclass
class MaterialReader:
    """Reads `<material>` elements, and notes script materials that are nowhere to be found."""

    resources: Resources
    textures: TextureStore
    left_out: LeftOut
    _scripts: dict[Path, dict[str, tuple[OgreMaterial, Path]]] = field(default_factory=dict)

    def read(self, visual: Element, folder: Path, where: str) -> Look | None:
        """The look that a visual asks for, or None if it leaves that to its mesh.

        Where a visual has several `<material>` elements, the first that can be resolved counts.
        """
        missing: str | None = None
        look: Look | None = None
        for element in visual.findall("material"):
            script = element.find("script")
            if script is None:
                look = self._plain(element, folder, where)
            else:
                name = text_of(script, "name")
                look = self._script(element, script, name, folder, where)
                missing = missing or (name if look is None else None)
            if look is not None:
                return self._faded(look, visual, where)
        if missing:
            self.left_out.missing("material", missing)
        return None

    def _faded(self, look: Look, visual: Element, where: str) -> Look:
        transparency = vector(visual, "transparency", (0.0,), where)[0]
        r, g, b, a = look.material.diffuse
        faded = (r, g, b, a * min(max(1.0 - transparency, 0.0), 1.0))
        return replace(look, material=replace(look.material, diffuse=faded))

    def _plain(self, element: Element, folder: Path, where: str) -> Look | None:
        albedo = next((e.text or "" for e in element.iter("albedo_map") if (e.text or "").strip()), "")
        coloured = element.find("diffuse") is not None or element.find("ambient") is not None
        if not albedo and not coloured:
            return None
        texture = self.textures.find(albedo, folder) if albedo else None
        ambient = _WHITE if albedo else colour(element, "ambient", _WHITE, where)
        r, g, b, a = colour(element, "diffuse", ambient, where)
        e = colour(element, "emissive", (0.0, 0.0, 0.0, 1.0), where)
        s = colour(element, "specular", (0.0, 0.0, 0.0, 1.0), where)
        name = f"{folder.name}/{Path(albedo.strip()).name or 'colour'}"
        return Look(Material(name, (r, g, b, a), texture, (1.0, 1.0), (e[0], e[1], e[2]), (s[0], s[1], s[2])))

    def _script(self, element: Element, script: Element, name: str, folder: Path, where: str) -> Look | None:
        found: tuple[OgreMaterial, Path] | None = None
        for uri in script.findall("uri"):
            path = self.resources.find(uri.text or "", folder, where) if (uri.text or "").strip() else None
            if path is not None and found is None:
                found = self._materials_at(path).get(name)
        if found is not None:
            ogre, script_folder = found
            texture = self.textures.find(ogre.texture, script_folder) if ogre.texture else None
            r, g, b, a = (*(ogre.diffuse or _WHITE), 1.0)[:4]
            e = ogre.emissive or (0.0, 0.0, 0.0)
            s = ogre.specular or (0.0, 0.0, 0.0)
            material = Material(name, (r, g, b, a), texture, (1.0, 1.0), (e[0], e[1], e[2]), (s[0], s[1], s[2]))
            # Ogre scales the texture, so twice the scale is half the repeats.
            look = Look(material, (1.0 / ogre.scale[0], 1.0 / ogre.scale[1]))
        else:
            stock = stock_material(name)
            if stock is None:
                return None
            look = Look(stock[0], tile=stock[1])
        if element.find("diffuse") is not None:
            r, g, b, a = colour(element, "diffuse", _WHITE, where)
            look = replace(look, material=replace(look.material, diffuse=(r, g, b, a)))
        return look

    def _materials_at(self, path: Path) -> dict[str, tuple[OgreMaterial, Path]]:
        """Materials of a script file, or of every script in a folder, each with the folder of its script."""
        if path not in self._scripts:
            files = self.resources.scripts_in(path) if path.is_dir() else [path]
            materials: dict[str, tuple[OgreMaterial, Path]] = {}
            for file in files:
                text = self.resources.read(file).decode("utf-8", errors="replace")
                for name, material in parse_material_script(text).items():
                    materials.setdefault(name, (material, file.parent))
            self._scripts[path] = materials
        return self._scripts[path]
