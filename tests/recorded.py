"""A study of recorded runs with everything that its page shows, written as files."""

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from taskslam.geometry import SE2
from taskslam.record.trajectories import SpatialTrajectory, write_trajectory
from taskslam.world import FloorPlan
from taskslam.world.map_server import save_floor_plan

STEP = 50_000_000
DIVERGED, GAP = 3, slice(120, 180)


def write_study(folder, count=400):
    """Two sequences: `vins` of five runs of which one diverged, `orb` of four with a gap, `<b>odd` of one; returns it.

    Also a file that is none, and a map.
    """
    rng = np.random.default_rng(3)
    t = np.arange(count) / 20
    way = np.column_stack([4 * np.sin(t / 3), 3 * np.cos(t / 2), 1.2 + 0.5 * np.sin(t)])
    turns = Rotation.from_rotvec(np.column_stack([0 * t, 0.1 * np.sin(t), t / 4]))
    sequences = {}
    for number, name in enumerate(("MH_08", "MH_09")):
        place = folder / name
        place.mkdir(parents=True)
        stamps = (1_403_636_580 + 1000 * number) * 1_000_000_000 + np.arange(count) * STEP
        write_trajectory(place / "groundtruth.tum", SpatialTrajectory(stamps, way, turns.as_quat()))
        for method, noise, runs in (("vins", 0.002, 5), ("orb", 0.001, 4), ("odd", 0.003, 1)):
            for run in range(runs):
                factor = 20 if (method, run) == ("vins", DIVERGED) else 1
                there = np.ones(count, dtype=bool)
                if method == "orb":
                    there[GAP] = False
                drift = np.cumsum(rng.normal(0, factor * noise, way.shape), axis=0)
                turned = turns * Rotation.from_rotvec(np.cumsum(rng.normal(0, noise / 9, way.shape), axis=0))
                estimate = SpatialTrajectory(stamps[there], (way + drift)[there], turned.as_quat()[there])
                write_trajectory(place / f"{method}_run{run}.tum", estimate)
        (place / "orb_run9.tum").write_text("nonsense\n")
        files = {"vins": f"{name}/vins_run*.tum", "orb": f"{name}/orb_run*.tum", "<b>odd": f"{name}/odd_run0.tum"}
        sequences[name] = {"groundtruth": f"{name}/groundtruth.tum", "runs": files}
    cells = np.zeros((80, 110), dtype=np.uint8)
    save_floor_plan(FloorPlan(cells, 0.1, SE2(-5.5, -4.0, 0.0)), folder / "plan.yaml", "png")
    sequences["MH_09"]["map"] = "plan.yaml"
    study = folder / "study.yaml"
    study.write_text(yaml.safe_dump({"sequences": sequences, "settings": {"rpe": ["1m", "2s", "20frames"]}}))
    return study
