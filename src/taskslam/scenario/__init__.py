"""What is to be driven: world, floor plan, start, waypoints, robot, protocol; one YAML file, validated on load."""

from taskslam.scenario.checks import check_scenario
from taskslam.scenario.loading import load_scenario, shipped_scenarios
from taskslam.scenario.scenario import (
    FloorPlanSource,
    Scenario,
    WorldSource,
)

__all__ = [
    "FloorPlanSource",
    "Scenario",
    "WorldSource",
    "check_scenario",
    "load_scenario",
    "shipped_scenarios",
]
