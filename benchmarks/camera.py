"""Camera frames, textured and lit, against raw embreex primary rays and MuJoCo's software renderer, in one run.

    python benchmarks/camera.py [--world FILE] [--memory FILE]

One core, the same 752x480 pixels, the same triangles, the same poses. Limits: ours in at most half the time of
Embree's rays alone, and faster than MuJoCo, thread for thread (`pip install mujoco` and Debian's libegl1 or
libosmesa6; left out, with the reason, where it cannot draw). Also the memory of a large world with its textures.
"""

from __future__ import annotations

import argparse
import math
import os
import resource
import statistics
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from common import aws_world, machine_line, pin_to_one_core, single_rays
from taskslam.geometry import OPTICAL_IN_BODY, SE2, FloatArray
from taskslam.robot import load_robot
from taskslam.simulation.motion import Motion
from taskslam.simulation.rendering.rasterizer import Pinhole
from taskslam.simulation.rendering.scene import Scene
from taskslam.simulation.sensors.camera import StereoCameraSensor, pinhole_of
from taskslam.world import World
from taskslam.world.loading import load_world

HEIGHT = 0.31
Draw = Callable[[FloatArray], object]


def seconds(work: Callable[[], object]) -> float:
    """Processor time of this thread and of any that it waits for: other people's load does not count."""
    begun = time.process_time()
    work()
    return time.process_time() - begun


def poses(count: int) -> list[FloatArray]:
    """Optical frames at the robot's camera height about the middle of the world."""
    places = np.random.default_rng(0).uniform((-6, -3, -np.pi), (6, 1, np.pi), (count, 3))
    lift = np.eye(4)
    lift[2, 3] = HEIGHT
    return [SE2(*place).matrix() @ lift @ OPTICAL_IN_BODY for place in places]


def embree(world: World, pinhole: Pinhole) -> Draw:
    rays = single_rays(world.visual)
    column, row = np.meshgrid(np.arange(pinhole.width), np.arange(pinhole.height))
    x, y = (column - pinhole.center[0]) / pinhole.focal, (row - pinhole.center[1]) / pinhole.focal
    ahead = np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3)
    turned: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

    def draw(T: FloatArray) -> object:
        if T.tobytes() not in turned:  # only the rays' own time counts; the first round is not measured
            origins = np.tile(T[:3, 3].astype(np.float32), (len(ahead), 1))
            turned[T.tobytes()] = origins, np.ascontiguousarray(ahead @ T[:3, :3].T, np.float32)
        return rays.run(*turned[T.tobytes()], output=1)

    return draw


def mujoco_renderer(world: World, pinhole: Pinhole) -> Draw | str:
    """MuJoCo on Mesa's llvmpipe with one thread, no shadows, no textures; or the reason why there is none."""
    os.environ.setdefault("MUJOCO_GL", "egl")
    os.environ["LP_NUM_THREADS"] = "0"  # llvmpipe draws in the calling thread
    try:
        import mujoco

        model = _mujoco_model(mujoco, world, pinhole)
        data = mujoco.MjData(model)
        renderer = mujoco.Renderer(model, pinhole.height, pinhole.width)
    except Exception as error:  # whatever its bindings and Mesa raise is the reason to tell
        return f"{type(error).__name__}: {str(error).splitlines()[0] if str(error) else ''}"
    half_turn = np.diag([1.0, -1.0, -1.0])  # MuJoCo's cameras look along -z with y up

    def draw(T: FloatArray) -> object:
        model.cam_pos[0] = T[:3, 3]
        mujoco.mju_mat2Quat(model.cam_quat[0], np.ascontiguousarray(T[:3, :3] @ half_turn).ravel())
        mujoco.mj_camlight(model, data)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_camlight(model, data)
        renderer.update_scene(data, camera=0)
        renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = False
        renderer.scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False
        return renderer.render()

    return draw


def _mujoco_model(mujoco, world: World, pinhole: Pinhole):  # type: ignore[no-untyped-def]
    spec = mujoco.MjSpec()
    spec.visual.global_.offwidth, spec.visual.global_.offheight = pinhole.width, pinhole.height
    corners = world.visual.corners().astype(np.float64)
    for part, triangles in enumerate(np.array_split(np.arange(len(corners)), math.ceil(len(corners) / 40_000))):
        vertices, index = np.unique(corners[triangles].reshape(-1, 3), axis=0, return_inverse=True)
        mesh = spec.add_mesh(name=f"part{part}")
        mesh.uservert, mesh.userface = vertices.ravel().tolist(), index.ravel().tolist()
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        shape = mujoco.mjtGeom.mjGEOM_MESH
        spec.worldbody.add_geom(type=shape, meshname=f"part{part}", contype=0, conaffinity=0)
    spec.worldbody.add_light(pos=[0, 0, 2.2])
    fovy = math.degrees(2.0 * math.atan(0.5 * pinhole.height / pinhole.focal))
    spec.worldbody.add_camera(name="camera", fovy=fovy)
    return spec.compile()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--world", type=Path, default=aws_world("aws_small_house"))
    parser.add_argument("--memory", type=Path, default=aws_world("aws_hospital"))
    parser.add_argument("--views", type=int, default=20)
    arguments = parser.parse_args()
    pin_to_one_core()
    world = load_world(arguments.world or "house")
    camera = load_robot("turtlebot2").rig.stereo
    assert camera is not None
    pinhole = pinhole_of(camera)
    scene = Scene(world)
    renderers: dict[str, Draw] = {
        "ours, grey, textured and lit": lambda T: scene.view(T, pinhole),
        "raw embreex primary rays": embree(world, pinhole),
    }
    reason = mujoco_renderer(world, pinhole)
    if isinstance(reason, str):
        print(f"MuJoCo left out: {reason}", file=sys.stderr)
    else:
        renderers["MuJoCo, lit, no texture"] = reason
    times: dict[str, list[float]] = {name: [] for name in renderers}
    for repeat in range(4):
        for T in poses(arguments.views):
            for name, draw in renderers.items():
                spent = seconds(partial(draw, T))
                if repeat > 0:
                    times[name].append(spent)
    medians = {name: statistics.median(values) for name, values in times.items()}
    print(machine_line())
    print(f"{world.name}: {len(world.visual):,} triangles, {pinhole.width}x{pinhole.height}, one core, processor time")
    ours = next(iter(medians.values()))
    for name, median in medians.items():
        print(f"{name:30} {1e3 * median:6.1f} ms a frame, ours takes {ours / median:.2f} of it")
    sensor = StereoCameraSensor(camera, world, seed=0)
    motions = [Motion(0, SE2.from_matrix(T @ np.linalg.inv(OPTICAL_IN_BODY))) for T in poses(arguments.views)]
    sensor.measure(0, motions[0])
    pair = statistics.median(seconds(partial(sensor.measure, 0, motion)) for motion in motions)
    print(f"{'a pair with exposure and noise':30} {1e3 * pair:6.1f} ms")
    if arguments.memory is not None:
        large = load_world(arguments.memory)
        begun = time.process_time()
        grey, color = Scene(large), Scene(large, color=True)
        print(
            f"{large.name}: {len(large.visual):,} triangles; scene {grey.nbytes / 2**20:.0f} MiB grey,"
            f" {color.nbytes / 2**20:.0f} MiB colour, both ready in {time.process_time() - begun:.1f} s"
        )
    print(f"peak memory of all this: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**10:.0f} MiB")


if __name__ == "__main__":
    main()
