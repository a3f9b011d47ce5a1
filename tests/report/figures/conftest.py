"""Results read back from synthetic runs."""

import pytest

from taskslam.report.results import read_results

CARDS = {
    "karto": {"sensors": ["laser_scan"], "kind": "slam"},
    "rko_lio": {"sensors": ["point_cloud", "imu"], "kind": "slam"},
    "orb_slam3": {"sensors": ["stereo_images"], "kind": "slam"},
    "ground_truth": {"sensors": ["true_pose"], "kind": "reference"},
}


@pytest.fixture
def results(make_run, tmp_path):
    """Three methods and a reference in both modes; rko_lio misses a waypoint with map."""
    for index, (method, card) in enumerate(CARDS.items()):
        for mode in ("without-map", "with-map"):
            make_run(
                f"{method}/{mode}", method=method, mode=mode, card=card.items(), spread=0.003 * 3**index,
                failed=(method, mode) == ("rko_lio", "with-map"),
            )  # fmt: skip
    return read_results([tmp_path / "results"])
