"""What is to be driven: world, floor plan, start, waypoints, robot, protocol; one YAML file, validated on load."""

from taskslam.scenario.checks import check_scenario
from taskslam.scenario.loading import load_scenario, shipped_scenarios
from taskslam.scenario.scenario import (
    FloorPlanSource,
    OnFailure,
    Protocol,
    Scenario,
    Sequence,
    TaskUnits,
    Waypoint,
    WorldSource,
)

__all__ = [
    "FloorPlanSource",
    "OnFailure",
    "Protocol",
    "Scenario",
    "Sequence",
    "TaskUnits",
    "Waypoint",
    "WorldSource",
    "check_scenario",
    "load_scenario",
    "shipped_scenarios",
]
