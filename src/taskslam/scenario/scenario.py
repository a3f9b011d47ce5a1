"""`Scenario`: a task at a place, for a robot."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from taskslam.task import BUILTIN_PLANNER, Part, Sequence, Task, Waypoint

Height = Annotated[float, Field(ge=-1e4, le=1e4)]
AboveFloor = Annotated[float, Field(gt=0, le=1e4)]


class WorldSource(Part):
    """Where the world comes from: a registered world by `name`, a Gazebo `file` of the user's own copy, or `walls`.

    walls: m; walls so high are raised on the occupied cells of `floor_plan.map`.
    source: the public repository to clone. resource_paths: folders with models, relative to the world file.
    floor_height: z of the floor that the robot drives on, in the world file; the world is lowered by it.
    exclude: models to leave out, by name: a robot that stands at the start, a door that is to be open.
    lidar_geometry: what LiDAR rays meet, visual meshes (Gazebo's GPU sensor) or collision meshes (its CPU sensor).
    """

    name: str | None = None
    file: str | None = None
    walls: Annotated[float, Field(gt=0.1, le=100)] | None = None
    source: str = ""
    resource_paths: tuple[str, ...] = ()
    floor_height: Height = 0.0
    exclude: tuple[str, ...] = ()
    lidar_geometry: Literal["visual", "collision"] = "visual"

    @model_serializer(mode="wrap")
    def _without_what_came_later(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """What is not given is not written of `exclude` and `walls`: runs of before these keep their digest."""
        content: dict[str, Any] = write(self)
        return {key: value for key, value in content.items() if value or key not in ("exclude", "walls")}

    @model_validator(mode="after")
    def _one_of_three(self) -> WorldSource:
        if sum(source is not None for source in (self.name, self.file, self.walls)) != 1:
            raise ValueError(
                "give one of `name` (a registered world), `file` (a Gazebo world) and `walls` (m, raised on the map)"
            )
        return self


class FloorPlanSource(Part):
    """A ROS map_server `map` (yaml), or a plan sliced from the world between two heights (m)."""

    map: str | None = None
    free_205: bool = False
    slice_low: AboveFloor = 0.02
    slice_high: AboveFloor = 0.45
    resolution: Annotated[float, Field(ge=1e-6, le=100)] = 0.05

    @model_validator(mode="after")
    def _ordered(self) -> FloorPlanSource:
        if self.slice_high <= self.slice_low:
            raise ValueError(f"slice_high {self.slice_high} must be above slice_low {self.slice_low}")
        return self


class Scenario(Task):
    """Everything that is held fixed while methods are compared.

    world: None where the platform brings its own, as a real robot does; then `floor_plan.map` says what it looks like.
    planner: the local one (`taskslam planners list`).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_.-]+$")]
    world: WorldSource | None = None
    floor_plan: FloorPlanSource = FloorPlanSource()
    robot: str = "turtlebot2"
    planner: str = BUILTIN_PLANNER
    start: Waypoint
    sequence: Sequence

    @model_validator(mode="after")
    def _some_floor_plan(self) -> Scenario:
        if self.world is None and self.floor_plan.map is None:
            raise ValueError("give `world`, or `floor_plan.map` where the robot brings a world of its own")
        if self.world is not None and self.world.walls is not None and self.floor_plan.map is None:
            raise ValueError("`world.walls` are raised on a map: give `floor_plan.map`")
        return self
