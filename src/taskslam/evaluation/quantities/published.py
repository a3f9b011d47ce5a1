"""Completeness, precision and accuracy: what the paper measures (eqs. (1) to (3); protocol 5.2, 5.3)."""

from __future__ import annotations

from taskslam.evaluation.pooled import pooled_completeness
from taskslam.evaluation.quantity import Dimension, Judged, Quantity, WorseIs, mean_over_complete

COMPLETENESS = Quantity(
    key="completeness",
    symbol="C",
    words="waypoints reached in every round, of all that were planned",
    dimension=Dimension.SHARE,
    worse_is=WorseIs.LESS,
    of_runs=pooled_completeness,
    interval=lambda _, sure: sure.completeness,
    judged=Judged.EVENT,
    fair=False,
    latex="$C$",
)

PRECISION = Quantity(
    key="precision",
    symbol="E",
    words="mean distance of a waypoint's arrivals to their mean",
    dimension=Dimension.LENGTH,
    worse_is=WorseIs.MORE,
    of_runs=mean_over_complete(lambda waypoint: waypoint.position.precision_m),
    of_waypoint=lambda waypoint: waypoint.position.precision_m,
    interval=lambda _, sure: sure.precision_m,
    judged=Judged.ARRIVALS,
    latex="$E$",
)

ACCURACY = Quantity(
    key="accuracy",
    symbol="e",
    words="mean distance of a waypoint's arrivals to the goal",
    dimension=Dimension.LENGTH,
    worse_is=WorseIs.MORE,
    of_runs=mean_over_complete(lambda waypoint: waypoint.position.accuracy_m),
    of_waypoint=lambda waypoint: waypoint.position.accuracy_m,
    interval=lambda _, sure: sure.accuracy_m,
    judged=Judged.ARRIVALS,
    latex="$e$",
)

HEADING_PRECISION = Quantity(
    key="heading_precision",
    symbol="Δ",
    words="mean angle of a waypoint's arrivals to their mean heading",
    dimension=Dimension.ANGLE,
    worse_is=WorseIs.MORE,
    of_runs=mean_over_complete(lambda waypoint: waypoint.orientation.precision_rad),
    of_waypoint=lambda waypoint: waypoint.orientation.precision_rad,
    interval=lambda _, sure: sure.precision_rad,
    latex=r"$\Delta$",
)

HEADING_ACCURACY = Quantity(
    key="heading_accuracy",
    symbol="δ",
    words="mean angle of a waypoint's arrivals to the goal's heading",
    dimension=Dimension.ANGLE,
    worse_is=WorseIs.MORE,
    of_runs=mean_over_complete(lambda waypoint: waypoint.orientation.accuracy_rad),
    of_waypoint=lambda waypoint: waypoint.orientation.accuracy_rad,
    interval=lambda _, sure: sure.accuracy_rad,
    latex=r"$\delta$",
)
