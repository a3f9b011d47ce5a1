"""The `taskslam` command and its verbs. They import what is heavy when they run, so that `--help` is instant."""

from __future__ import annotations

import typer

from taskslam.cli import (
    camera,
    campaign,
    choose,
    compare,
    doctor,
    evaluate,
    evaluate_trajectories,
    export,
    figures,
    film,
    import_trials,
    lab,
    measure,
    methods,
    place,
    planners,
    replay,
    report,
    ros,
    run,
    runs,
    scenarios,
    serve,
    spread,
    suite,
    tags,
    verify,
    watch,
    worlds,
)
from taskslam.cli.console import say
from taskslam.version import __version__

app = typer.Typer(
    name="taskslam",
    no_args_is_help=True,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    help="Put SLAM inside the navigation loop: did the robot arrive, and how closely do its arrivals agree?",
)
app.command("demo")(run.demo)
app.command("run")(run.run)
app.command("serve")(serve.serve)
app.command("suite")(suite.suite)
app.add_typer(campaign.app, name="campaign")
app.command("watch")(watch.watch)
app.command("spread")(spread.spread)
app.command("choose")(choose.choose)
app.command("lab")(lab.lab)
app.command("runs")(runs.runs)
app.command("verify")(verify.verify)
app.command("evaluate")(evaluate.evaluate)
app.command("evaluate-trajectories")(evaluate_trajectories.evaluate_trajectories)
app.command("export")(export.export)
app.command("replay")(replay.replay)
app.command("import-trials")(import_trials.import_trials)
app.command("report")(report.report)
app.command("figures")(figures.figures)
app.command("film")(film.film)
app.command("compare")(compare.compare)
app.add_typer(scenarios.app, name="scenarios")
app.add_typer(place.app, name="place")
app.add_typer(worlds.app, name="worlds")
app.add_typer(methods.app, name="methods")
app.add_typer(planners.app, name="planners")
app.add_typer(ros.app, name="ros")
app.add_typer(tags.app, name="tags")
app.add_typer(camera.app, name="camera")
app.add_typer(measure.app, name="measure")
app.command("doctor")(doctor.doctor)


def _show_version(wanted: bool) -> None:
    if wanted:
        say(f"taskslam {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: bool = typer.Option(False, "--version", callback=_show_version, is_eager=True, help="Print the version."),
) -> None:
    pass
