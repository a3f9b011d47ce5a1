"""What an open-loop study says in sentences: its verdict, and what must be known before numbers are believed."""

from __future__ import annotations

from taskslam.report import words
from taskslam.studies.study_results import MethodSummary, OpenLoopResults


def verdict_sentence(results: OpenLoopResults) -> str:
    """Whether precision beats accuracy here."""
    verdict = results.verdict
    if not verdict.compared:
        return "Precision needs at least two runs of a method that share frames: there are none here."
    parts = []
    for what, names, beaten in (("position", "e is {} times E", verdict.position),
                                ("orientation", "δ {} times Δ", verdict.orientation)):  # fmt: skip
        factor = names.format(f"{beaten.ratio or 0:.2f}")
        parts.append(f"{what} for {beaten.results} of {verdict.compared} (clearly for {beaten.clearly}; {factor})")
    return (
        f"Precision beats accuracy in {' and in '.join(parts)}: medians, with E and Δ corrected for the number of "
        "runs; clearly: the 95 % interval over runs says so. Errors independent from run to run would give 1."
    )


def cautions(result: MethodSummary) -> list[str]:
    """What must be known of these runs before their numbers are believed."""
    who = f"{result.sequence}, {result.method}"
    said = []
    if result.interpolated:
        said.append(
            f"{who}: the runs share no stamps; they are compared at the {result.common.frames} times of the run with"
            " fewest poses, interpolated (--frame-tolerance would pair stamps that differ)."
        )
    if result.diverged and result.without_diverged is not None:
        with_all, without = (
            "–" if frames.precision_m is None else f"{words.centimetres(frames.precision_m)} cm"
            for frames in (result.compared_frames, result.without_diverged)
        )
        said.append(
            f"{who}: {len(result.diverged)} of {len(result.runs)} runs diverged ({', '.join(result.diverged)}):"
            f" E is {with_all} with and {without} without."
        )
    return said
