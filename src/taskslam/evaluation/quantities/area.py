"""N-AUC: the area under the cumulative precision curve (protocol 5.4), exactly and on the published grid."""

from __future__ import annotations

from taskslam.evaluation.pooled import pooled_area
from taskslam.evaluation.quantity import Dimension, Judged, Quantity, WorseIs

EXACT = Quantity(
    key="n_auc",
    symbol="N-AUC",
    words="exact area under the cumulative curve of E up to 120 cm, 1 at best; what was missed adds nothing",
    dimension=Dimension.NUMBER,
    worse_is=WorseIs.LESS,
    of_runs=lambda runs, missing: pooled_area(runs, missing).exact,
    interval=lambda _, sure: sure.n_auc_exact,
    judged=Judged.BOTH,
    fair=False,
)

PUBLISHED = Quantity(
    key="n_auc_published",
    symbol="N-AUC₁₅",
    words="the same by trapezoids over steps of 15 cm, as published; at most 0.938",
    dimension=Dimension.NUMBER,
    worse_is=WorseIs.LESS,
    of_runs=lambda runs, missing: pooled_area(runs, missing).published,
    judged=Judged.BOTH,
    fair=False,
    latex="N-AUC$_{15}$",
    essential=False,
)
