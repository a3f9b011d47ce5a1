from pathlib import Path

from taskslam.slam.orb.start_map import StartMap

FRAME = 33_333_333


class Maps:
    """Keyframe files as the package writes them, of whichever map is active."""

    def __init__(self):
        self.active = []
        self.looks = 0

    def save_keyframe_trajectory_tum(self, filename):
        self.looks += 1
        Path(filename).write_text("".join(f"{stamp / 1e9:.6f} 0 0 0 0 0 0 1\n" for stamp in self.active))


def judged(tmp_path, maps, frames):
    """One letter a frame for a list of (tracked, stamps of the active map's keyframes)."""
    judge = StartMap(maps, tmp_path / "keyframes.tum")
    said = ""
    for n, (tracked, keyframes) in enumerate(frames):
        maps.active = keyframes
        said += "T" if judge.holds(tracked, 10 * FRAME + n * FRAME) else "-"
    return said


OLD, NEW = [10 * FRAME, 20 * FRAME], [40 * FRAME, 50 * FRAME]


def test_nothing_is_asked_while_tracking_goes_on(tmp_path):
    maps = Maps()
    assert judged(tmp_path, maps, [(True, OLD)] * 5) == "TTTTT"
    assert maps.looks == 0


def test_relocalised_in_the_start_map_is_tracking_at_once(tmp_path):
    assert judged(tmp_path, Maps(), [(True, OLD)] * 2 + [(False, OLD)] * 2 + [(True, OLD)] * 2) == "TT--TT"


def test_a_new_map_is_lost_however_long_it_tracks(tmp_path):
    maps = Maps()
    assert judged(tmp_path, maps, [(True, OLD)] * 2 + [(False, OLD)] + [(True, NEW)] * 60) == "TT" + "-" * 61
    assert maps.looks <= 5  # every half second, not every frame


def test_a_new_map_that_is_merged_into_the_start_map_counts_again(tmp_path):
    frames = [(True, OLD), (False, OLD)] + [(True, NEW)] * 40 + [(True, OLD + NEW)] * 20
    said = judged(tmp_path, Maps(), frames)
    assert said[:42] == "T" + "-" * 41
    assert said.endswith("TTTTT")


def test_no_keyframe_yet_is_no_start_map(tmp_path):
    assert judged(tmp_path, Maps(), [(True, OLD), (False, []), (True, [])]) == "T--"
