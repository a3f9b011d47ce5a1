"""Import of Gazebo worlds: SDF 1.4 to 1.11 with models, meshes, materials and lights."""

from taskslam.world.gazebo.importer import import_sdf
from taskslam.world.gazebo.resources import Resources, search_roots

__all__ = ["Resources", "import_sdf", "search_roots"]
