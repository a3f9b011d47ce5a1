"""Import of Gazebo worlds: SDF 1.3 to 1.12 with models, meshes, materials and lights.

`importer.import_sdf` is the way in; `taskslam.world.loading.load_world` calls it and caches what it gives.
"""
