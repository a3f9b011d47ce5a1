"""Worlds: textured triangle meshes with lights, and floor plans."""

from taskslam.world.floor_plan import FloorPlan
from taskslam.world.world import Light, Material, TriangleMesh, World

__all__ = ["FloorPlan", "Light", "Material", "TriangleMesh", "World"]
