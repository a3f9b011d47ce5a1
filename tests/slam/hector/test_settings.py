from taskslam.slam.hector.settings import HectorSettings


def test_published_values_are_the_defaults() -> None:
    """Protocol 1.3."""
    s = HectorSettings()
    assert (s.map_resolution, s.map_size, s.map_multi_res_levels) == (0.05, 4096, 2)
    assert (s.map_update_distance_thresh, s.map_update_angle_thresh) == (0.4, 0.06)
    assert (s.update_factor_free, s.update_factor_occupied) == (0.4, 0.9)
