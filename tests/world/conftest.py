"""Tiny Gazebo worlds, written where a test wants them."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from taskslam.world.loading import load_world
from taskslam.world.world import TriangleMesh, World

BOX = "<geometry><box><size>{0} {1} {2}</size></box></geometry>"


@dataclass
class Site:
    """A folder with a world file and models, as a user has them."""

    root: Path

    def world(self, body: str, version: str = "1.6", name: str = "test") -> Path:
        path = self.root / "worlds" / f"{name}.world"
        path.parent.mkdir(exist_ok=True)
        path.write_text(f"<sdf version='{version}'><world name='default'>{body}</world></sdf>")
        return path

    def model(self, name: str, body: str, version: str = "1.6", config: str | None = None) -> Path:
        folder = self.root / "models" / name
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "model.sdf").write_text(f"<sdf version='{version}'><model name='{name}'>{body}</model></sdf>")
        listed = f"<sdf version='{version}'>model.sdf</sdf>" if config is None else config
        (folder / "model.config").write_text(f"<model><name>{name}</name>{listed}</model>")
        return folder

    def file(self, path: str, content: str | bytes) -> Path:
        target = self.root / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content.encode() if isinstance(content, str) else content)
        return target

    def load(self, body: str, version: str = "1.6") -> World:
        return load_world(self.world(body, version), use_cache=False)


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Site:
    for variable in ("GAZEBO_MODEL_PATH", "GAZEBO_RESOURCE_PATH", "GZ_SIM_RESOURCE_PATH"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setenv("TASKSLAM_CACHE", str(tmp_path / "cache"))
    return Site(tmp_path)


@pytest.fixture
def link() -> Callable[..., str]:
    """A link with one box, the same to see and to touch; attributes and poses as given."""

    def make(name: str = "link", size: tuple[float, float, float] = (1, 1, 1), pose: str = "", visual: str = "") -> str:
        shape = BOX.format(*size)
        return (
            f"<link name='{name}'>{pose}<visual name='v'>{visual}{shape}</visual>"
            f"<collision name='c'>{visual}{shape}</collision></link>"
        )

    return make


def png(colour: tuple[int, ...], size: tuple[int, int] = (4, 4)) -> bytes:
    """A PNG of one colour."""
    buffer = io.BytesIO()
    Image.new("RGBA" if len(colour) == 4 else "RGB", size, colour).save(buffer, "PNG")
    return buffer.getvalue()


def dae(unit: str = "1", up: str = "Z_UP", image: str = "", nodes: str = "", points: str | None = None) -> str:
    """A COLLADA file with a tetrahedron of legs 1 x 2 x 3, in a scene of one node `part` unless nodes are given."""
    points = points or "0 0 0 1 0 0 0 2 0 0 0 3"
    diffuse = "<texture texture='s' texcoord='UV'/>" if image else "<color>1 0 0 1</color>"
    library = f"<library_images><image id='i'><init_from>{image}</init_from></image></library_images>" if image else ""
    params = (
        "<newparam sid='f'><surface type='2D'><init_from>i</init_from></surface></newparam>"
        "<newparam sid='s'><sampler2D><source>f</source></sampler2D></newparam>"
    )
    instance = (
        "<instance_geometry url='#g'><bind_material><technique_common><instance_material symbol='m' target='#mat'/>"
        "</technique_common></bind_material></instance_geometry>"
    )
    nodes = nodes.replace("GEOMETRY", instance) or f"<node id='n' name='part'>{instance}</node>"
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><created>2020-01-01T00:00:00</created><modified>2020-01-01T00:00:00</modified>
<unit meter="{unit}"/><up_axis>{up}</up_axis></asset>{library}
<library_effects><effect id="e"><profile_COMMON>{params if image else ""}<technique sid="c"><phong>
<diffuse>{diffuse}</diffuse></phong></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="mat" name="paint"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g" name="tetrahedron"><mesh>
<source id="p"><float_array id="pa" count="12">{points}</float_array><technique_common>
<accessor source="#pa" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<source id="t"><float_array id="ta" count="6">0 0 1 0 0 1</float_array><technique_common>
<accessor source="#ta" count="3" stride="2"><param name="S" type="float"/><param name="T" type="float"/>
</accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4" material="m"><input semantic="VERTEX" source="#v" offset="0"/>
<input semantic="TEXCOORD" source="#t" offset="1" set="0"/>
<p>0 0 2 1 1 2  0 0 1 1 3 2  0 0 3 1 2 2  1 0 2 1 3 2</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="vs">{nodes}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#vs"/></scene></COLLADA>"""


def extent(mesh: TriangleMesh) -> np.ndarray:
    """Lowest and highest corner, rounded to 0.1 mm, as one row x0 y0 z0 x1 y1 z1."""
    corners = mesh.corners().reshape(-1, 3).astype(float)
    return np.round(np.concatenate([corners.min(axis=0), corners.max(axis=0)]), 4) + 0.0


def volume(mesh: TriangleMesh) -> float:
    """Enclosed volume by the divergence theorem; negative if the triangles face inwards."""
    a, b, c = np.moveaxis(mesh.corners().astype(float), 1, 0)
    return float(np.einsum("nd,nd->", a, np.cross(b, c)) / 6.0)


@pytest.fixture(scope="session")
def make_png() -> Callable[..., bytes]:
    return png


@pytest.fixture(scope="session")
def make_dae() -> Callable[..., str]:
    return dae


@pytest.fixture(scope="session")
def extent_of() -> Callable[[TriangleMesh], np.ndarray]:
    return extent


@pytest.fixture(scope="session")
def volume_of() -> Callable[[TriangleMesh], float]:
    return volume
