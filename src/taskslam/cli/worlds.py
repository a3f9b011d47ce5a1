"""`taskslam worlds`: list, show, import and render worlds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from taskslam.cli.console import say, standard_output
from taskslam.cli.registered import registered_table

if TYPE_CHECKING:
    from taskslam.geometry import SE2
    from taskslam.world import World

app = typer.Typer(
    help="Worlds that the robot drives through: built-in ones and Gazebo worlds (SDF 1.3 to 1.12).",
    no_args_is_help=True,
)

_Reference = Annotated[str, typer.Argument(metavar="NAME|FILE", help="A name from `list`, or a .world or .sdf file.")]
_Resources = Annotated[
    list[Path] | None,
    typer.Option(
        "--resource-path",
        help="Folder with models or textures; may be given again. GZ_SIM_RESOURCE_PATH, GAZEBO_MODEL_PATH and "
        "GAZEBO_RESOURCE_PATH are read too.",
    ),
]


@app.command("list")
def list_worlds() -> None:
    """List the worlds that are known by name.

    Example: `taskslam worlds list`
    """
    from taskslam.world.loading import registered_worlds

    console = standard_output()
    console.print(registered_table(registered_worlds()))
    console.print("Any Gazebo world file can be used in the place of a name.", style="dim")


@app.command()
def show(reference: _Reference, resource_path: _Resources = None) -> None:
    """Show what a world holds: size, triangles, models, textures, lights, and what is missing from it.

    Example: `taskslam worlds show house`
    """
    from taskslam.world.loading import load_world

    _describe(load_world(reference, resource_path or ()))


@app.command("import")
def import_world(
    file: Annotated[Path, typer.Argument(metavar="FILE.world", help="A Gazebo world.")],
    resource_path: _Resources = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="Read everything again, even if nothing has changed.")] = False,
) -> None:
    """Read a Gazebo world into the cache and say what was found and what is missing.

    Example: `taskslam worlds import aws-robomaker-small-house-world/worlds/small_house.world`
    """
    import time

    from taskslam.files import cache_folder
    from taskslam.world.cache import cache_file
    from taskslam.world.gazebo.resources import search_roots
    from taskslam.world.loading import load_world

    absolute = file.expanduser().absolute()
    cached = cache_file(cache_folder(), absolute, search_roots(absolute, resource_path or ()))
    if fresh:
        cached.unlink(missing_ok=True)
    start = time.perf_counter()
    world = load_world(file, resource_path or ())
    _describe(world)
    size = f", {cached.stat().st_size / 1e6:.0f} MB in {cached}" if cached.exists() else ""
    standard_output().print(f"Loaded in {time.perf_counter() - start:.2f} s{size}", soft_wrap=True)


@app.command()
def render(
    reference: _Reference,
    out: Annotated[Path, typer.Option(help="Folder for top_down.png and perspective.png.")] = Path(),
    pose: Annotated[
        str, typer.Option(metavar="X,Y,YAW", help="Where to look from and to, metres and radians.")
    ] = "0,0,0",
    height: Annotated[float, typer.Option(help="Eye height, m.")] = 1.2,
    fov: Annotated[float, typer.Option(help="Horizontal field of view, degrees.", min=10.0, max=150.0)] = 75.0,
    cut: Annotated[float, typer.Option(help="Height of the cut for the view from above, m.")] = 2.0,
    size: Annotated[int, typer.Option(help="Longer side of the pictures, pixels.", min=16, max=8192)] = 1200,
    resource_path: _Resources = None,
) -> None:
    """Draw a world from above, with its ceiling cut away, and in perspective from a pose.

    Example: `taskslam worlds render house --out pictures --pose 1,2,1.57`
    """
    import math

    from PIL import Image

    from taskslam.errors import InputError
    from taskslam.simulation.rendering import world_pictures
    from taskslam.world.loading import load_world

    viewpoint = parse_pose(pose, "--pose")
    world = load_world(reference, resource_path or ())
    pictures = {
        "top_down.png": world_pictures.top_down(world, size, cut),
        "perspective.png": world_pictures.perspective(
            world, viewpoint, height, math.radians(fov), (size, max(1, round(size * 9 / 16)))
        ),
    }
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name, pixels in pictures.items():
            Image.fromarray(pixels).save(out / name)
    except OSError as error:
        raise InputError(f"Pictures cannot be written to {out}: {error.strerror or error}.") from error
    for name in pictures:
        say(str(out / name))


def parse_pose(text: str, option: str) -> SE2:
    """A pose x,y,yaw as an option gives it, m and rad. Raises InputError."""
    from taskslam.errors import InputError
    from taskslam.geometry import SE2

    try:
        x, y, yaw = (float(part) for part in text.split(","))
        pose = SE2(x, y, yaw)
    except ValueError:
        pose = SE2(float("nan"))
    if not pose.is_finite():
        raise InputError(f"{option} is '{text}'; expected x,y,yaw in metres and radians, for example 1.5,-2,0.8.")
    return pose


def _describe(world: World) -> None:
    from rich.table import Table

    low, high = world.bounds()
    textures = {id(m.texture): m.texture for m in world.materials if m.texture is not None}
    megabytes = sum(texture.nbytes for texture in textures.values()) / 1e6
    kinds = [light.type for light in world.lights]
    lights = ", ".join(f"{kinds.count(kind)} {kind}" for kind in sorted(set(kinds))) or "none (ambient only)"
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="bold")
    table.add_column()
    table.add_row("name", world.name)
    table.add_row("size", " x ".join(f"{side:.1f}" for side in high - low) + " m")
    table.add_row("corners", " to ".join("(" + ", ".join(f"{v:.2f}" for v in corner) + ")" for corner in (low, high)))
    table.add_row("triangles", f"{len(world.visual):,} visual, {len(world.collision):,} collision")
    table.add_row("models", f"{len(world.models)}")
    table.add_row("materials", f"{len(world.materials)}")
    table.add_row("textures", f"{len(textures)} ({megabytes:.0f} MB)")
    table.add_row("lights", lights)
    console = standard_output()
    console.print(table)
    for warning in world.warnings:
        console.print(f"Warning: {warning}", style="yellow")
    if any(warning.startswith("Missing") for warning in world.warnings):
        console.print("Name their folder with --resource-path or GAZEBO_MODEL_PATH if you have them.", style="dim")
