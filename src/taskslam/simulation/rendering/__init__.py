"""Pictures of a world: rasterising, light and texture."""
