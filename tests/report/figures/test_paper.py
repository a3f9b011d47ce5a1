import hashlib
from itertools import islice

import pytest

from taskslam.report.figures.paper import paper_figures
from taskslam.report.figures.style import FORMATS, WIDTHS, figure_bytes
from taskslam.report.results import read_results

MAIN = [
    "precision_accuracy_without_map",
    "precision_accuracy_with_map",
    "cumulative_precision",
    "success_within_tolerance",
    "violins_precision",
    "violins_accuracy",
    "quantities",
]


def texts_of(figure):
    return [text.get_text() for text in figure.findobj(lambda artist: hasattr(artist, "get_text"))]


def smallest_font(figure):
    from matplotlib.text import Text

    return min(text.get_fontsize() for text in figure.findobj(Text) if text.get_text().strip())


def outside(figure):
    """Texts that reach beyond the edge of the paper by more than a hair."""
    from matplotlib.text import Text

    figure.draw_without_rendering()
    page = figure.bbox
    found = []
    for text in figure.findobj(Text):
        if text.get_text().strip() and text.get_visible():
            box = text.get_window_extent()
            hair = 0.01 * figure.dpi
            if box.x0 < page.x0 - hair or box.x1 > page.x1 + hair or box.y0 < page.y0 - hair or box.y1 > page.y1 + hair:
                found.append(text.get_text())
    return found


def test_one_folder_gives_every_figure_of_the_paper(results):
    names = [name for name, _ in paper_figures(results, "column", "metric")]
    assert names[: len(MAIN)] == MAIN
    assert len([name for name in names if name.startswith("runs/arrivals_")]) == 8
    assert len([name for name in names if name.startswith("runs/trajectories_")]) == 8
    assert len(set(names)) == len(names)


@pytest.mark.parametrize(("width", "units"), [("column", "task"), ("page", "metric")])
def test_figures_fit_the_paper_with_letters_of_seven_points(results, width, units):
    for name, figure in paper_figures(results, width, units):
        assert figure.get_size_inches()[0] == WIDTHS[width], name
        assert smallest_font(figure) >= 7.0 * 0.69, name  # mathtext subscripts are 70 % of their line
        assert outside(figure) == [], name


def test_the_same_results_give_the_same_bytes(make_run):
    folder = make_run("a", failed=True).parent

    def digests():
        return {
            (name, kind): hashlib.sha256(figure_bytes(figure, kind)).hexdigest()
            for name, figure in paper_figures(read_results([folder]), "column", "metric")
            for kind in FORMATS
        }

    assert digests() == digests()


def test_a_file_holds_no_date_and_no_path(make_run):
    folder = make_run("a").parent
    _, figure = next(paper_figures(read_results([folder]), "column", "metric"))
    for kind in FORMATS:
        content = figure_bytes(figure, kind)
        for word in (b"/CreationDate", b"<dc:date>", b"tEXt", str(folder).encode()):
            assert word not in content, (kind, word)


def test_a_method_that_completed_nothing_is_drawn_with_zero(make_run):
    make_run("good")
    folder = make_run("bad", method="hector", failed=True, failed_goal=0).parent
    figures = dict(paper_figures(read_results([folder]), "column", "metric"))
    scatter = texts_of(figures[MAIN[0]])
    assert scatter.index("karto") < scatter.index("hector")
    assert "0" in scatter[scatter.index("hector") :]
    assert "(0 | –)" in texts_of(figures["violins_precision"])
    assert "0.000" in texts_of(figures["cumulative_precision"])


def test_one_round_has_no_precision_but_a_completeness(make_run):
    folder = make_run("a", rounds=1).parent
    figures = dict(paper_figures(read_results([folder]), "column", "metric"))
    assert "no precision to show" in texts_of(figures[MAIN[0]])
    assert "100" in texts_of(figures[MAIN[0]])
    assert "no precision to show" in texts_of(figures["cumulative_precision"])


def drawn(make_run, name="a", **options):
    """The figures of one run by the beginning of their names; each can be saved."""
    run = make_run(name, **options)
    figures = {found.partition("_synthetic")[0]: figure for found, figure in paper_figures(
        read_results([run]), "column", "metric")}  # fmt: skip
    for figure in figures.values():
        figure_bytes(figure, "png")
    return figures


def paths_in(figure):
    """Lines of more than a heading's two points on the map."""
    return [line for line in figure.axes[0].lines if len(line.get_xdata()) > 2]


def test_without_a_floor_plan_the_tour_is_drawn_on_white(make_run):
    assert len(drawn(make_run)["runs/trajectories"].axes[0].images) == 1
    assert len(drawn(make_run, name="b", plan=False)["runs/trajectories"].axes[0].images) == 0


def test_without_true_poses_at_the_arrivals_there_is_no_precision_to_show(make_run):
    figures = drawn(make_run, truth=False)
    for name in ("precision_accuracy_without_map", "cumulative_precision", "success_within_tolerance"):
        assert "no precision to show" in texts_of(figures[name]), name


def test_a_failure_is_marked_and_what_it_missed_is_hollow(make_run):
    whole, failed = drawn(make_run)["runs/trajectories"], drawn(make_run, name="b", failed=True)["runs/trajectories"]
    assert {"failure", "missed"} <= set(texts_of(failed))
    assert {"failure", "missed"}.isdisjoint(texts_of(whole))


def test_a_damaged_trajectory_leaves_its_round_out(make_run):
    run = make_run("a")
    trajectories = next(f for name, f in paper_figures(read_results([run]), "column", "metric") if "trajector" in name)
    (run / "round01" / "truth.tum").write_text("not a number\n", encoding="utf-8")
    damaged = next(f for name, f in paper_figures(read_results([run]), "column", "metric") if "trajector" in name)
    assert len(paths_in(damaged)) == len(paths_in(trajectories)) - 1


def test_twenty_methods_with_long_names_stay_on_the_paper(make_run):
    for index in range(20):
        name = f"method_{index:02d}_with_a_name_that_nobody_would_choose & 100 % $x_{{{index}"
        folder = make_run(f"m{index}", method=name, spread=0.002 * 1.3**index).parent
    drawn = islice(paper_figures(read_results([folder]), "column", "metric"), len(MAIN))
    for name, figure in drawn:
        assert outside(figure) == [], name
        if name in MAIN[:3]:
            assert {str(number) for number in range(1, 21)} <= {
                text.split()[0] for text in texts_of(figure) if text.strip()
            }


def test_twenty_methods_leave_little_paper_empty(make_run):
    runs = [make_run(f"{index}", method=f"method{index}", plan=False) for index in range(20)]
    figures = dict(islice(paper_figures(read_results([run.parent for run in runs]), "page", "metric"), 5))
    for name in ("precision_accuracy_without_map", "cumulative_precision"):
        width, height = figures[name].get_size_inches()
        drawn = sum(at.width * at.height for at in (axes.get_position() for axes in figures[name].axes))
        assert drawn > 0.6
        assert height < width


def test_the_title_of_a_run_with_a_long_name_is_shortened(make_run):
    name = "a name that is much too long for one column of a paper, and then some more words"
    folder = make_run("a", method=name).parent
    for name, figure in list(paper_figures(read_results([folder]), "column", "metric"))[-2:]:
        assert outside(figure) == [], name


def test_a_run_that_ended_in_its_priming_round_is_drawn_without_rounds(make_run, tmp_path):
    journal = make_run(mode="with-map") / "journal.jsonl"
    lines = journal.read_text().splitlines(keepends=True)
    journal.write_text("".join(line for line in lines if '"round":0' in line or "run_ended" in line))
    figures = dict(paper_figures(read_results([tmp_path / "results"]), "column", "metric"))
    (arrivals,) = [figure for name, figure in figures.items() if name.startswith("runs/arrivals_")]
    assert "goal" in texts_of(arrivals)
    assert "first round" not in texts_of(arrivals)


def test_linear_axes_begin_at_zero_in_every_figure_of_errors(results):
    figures = dict(islice(paper_figures(results, "page", "metric", linear=True), len(MAIN) - 1))
    for name, figure in figures.items():
        axes = figure.axes[:2] if "violins" not in name else figure.axes[:1]
        assert {one.get_xscale() for one in axes} == {"linear"}, name
        assert {one.get_xlim()[0] for one in axes} == {0.0}, name
        assert outside(figure) == [], name
    assert any(one.get_xscale() == "log" for _, f in paper_figures(results, "page", "metric") for one in f.axes)
