"""Files cut off or scribbled over at any place: a world or one clear WorldError, never anything else."""

import struct

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from taskslam.errors import WorldError
from taskslam.world.loading import load_world

fuzzed = settings(
    max_examples=80, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
OBJ = b"mtllib a.mtl\nusemtl p\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\n"
STL = b"\0" * 80 + struct.pack("<I", 1) + np.arange(12, dtype="<f4").tobytes() + b"\0\0"


def damaged(data, place, scribble):
    at = int(place * len(data))
    return data[:at] + scribble if len(scribble) < 2 else data[:at] + scribble + data[at + len(scribble) :]


def outcome(path):
    """The world, or None and what the one allowed error says."""
    try:
        return load_world(path, use_cache=False), ""
    except WorldError as error:
        return None, str(error)


@pytest.mark.parametrize("kind", ["dae", "obj", "stl", "glb"])
@given(place=st.floats(0, 0.999), scribble=st.binary(max_size=6))
@fuzzed
def test_damaged_mesh(site, make_dae, kind, place, scribble):
    whole = {
        "dae": make_dae().encode(),
        "obj": OBJ,
        "stl": STL,
        "glb": trimesh.Scene(trimesh.creation.box()).export(file_type="glb"),
    }[kind]
    site.file(f"worlds/a.{kind}", damaged(whole, place, scribble))
    mesh = f"<geometry><mesh><uri>a.{kind}</uri></mesh></geometry>"
    body = f"<model name='m'><link name='l'><visual name='v'>{mesh}</visual></link></model>"
    world, complaint = outcome(site.world(body))
    assert f"a.{kind}" in complaint if world is None else np.isfinite(world.visual.vertices).all()


WORLD = (
    b"<sdf version='1.6'><world name='w'><frame name='f'/><light name='s' type='point'/><model name='m'>"
    b"<pose relative_to='f'>1 2 3 0 0 0</pose><link name='l'><visual name='v'><geometry><box><size>1 1 1</size></box>"
    b"</geometry><material><diffuse>1 0 0 1</diffuse></material></visual></link></model></world></sdf>"
)


@given(place=st.floats(0, 0.999), scribble=st.binary(max_size=6))
@fuzzed
def test_damaged_world(site, place, scribble):
    world, complaint = outcome(site.file("worlds/test.world", damaged(WORLD, place, scribble)))
    assert world is not None or "test.world" in complaint
