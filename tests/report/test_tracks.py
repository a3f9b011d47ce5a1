from taskslam.record import load_run
from taskslam.report import write_report
from taskslam.report.tracks import Tracks


def test_a_damaged_trajectory_is_drawn_without_and_named(make_run):
    directory = make_run()
    (directory / "round01" / "estimate.tum").write_text("1 2 three\n")
    tracks = Tracks(load_run(directory))
    assert len(tracks.get(0, "estimate")) > 0
    assert len(tracks.get(1, "estimate")) == 0
    assert len(tracks.get(1, "estimate")) == 0  # read once, named once
    (reason,) = tracks.damage
    assert "estimate.tum, line 1" in reason


def test_the_page_says_which_trajectories_it_left_out(make_run, tmp_path):
    (make_run() / "round01" / "truth.tum").write_bytes(b"\x80\x81")
    text = write_report([tmp_path / "results"], tmp_path / "r.html").read_text()
    assert "1 part of the results was left out" in text
    assert "truth.tum" in text[text.index('<section id="left-out">') :]
