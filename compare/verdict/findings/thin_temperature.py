"""Granular temperature of a layer thinner than a grain."""

import numpy as np

from cases.scenes import is_chute, is_silo
from compare.mapping.clouds import StoredClouds
from compare.mapping.reductions import has_temperature
from compare.mapping.runs import Run
from compare.verdict.findings import Finding, Severity, check, worst

SHARE = 0.25


def energies(run: Run, frame: int) -> np.ndarray:
    """Of the points of a frame, (N,), up to a factor; none where they tell no temperature."""
    told = run.clouds.records(frame, ["mass", "granular_temperature"])  # type: ignore[attr-defined]
    return told["mass"] * told.get("granular_temperature", np.zeros(len(told["mass"])))


def at_base(run: Run) -> float:
    """Share of the fluctuation energy that lies within a grain's diameter above the base, in the
    frame nearest to the largest; 0 where points tell no temperature.
    """
    if not isinstance(run.clouds, StoredClouds) or not has_temperature(run):
        return 0.0
    if "fluctuation" in run.energy:
        largest = run.energy["time"][np.argmax(np.nan_to_num(run.energy["fluctuation"]))]
        frame = int(np.abs(run.time - largest).argmin())
    else:  # points of another program
        frame = max(range(len(run.time)), key=lambda i: energies(run, i).sum())
    energy = energies(run, frame)
    low = run.clouds[frame].x[:, 1] < run.case["grains.diameter"]
    return float(energy[low].sum() / energy.sum()) if energy.sum() > 0.0 else 0.0


@check(order=87)
def thin_temperature(c, metrics):
    """Share of the continuum's fluctuation energy within a grain's diameter above the base, when
    there is most of it. A layer thinner than a grain is no continuum: finer cells find more and
    more there, and little elsewhere (cases/column_small/reference/refinement.csv).
    """
    if not c.mpm or is_chute(c.mpm[0].case["geometry"]) or is_silo(c.mpm[0].case["geometry"]):
        return
    share, which = worst(c.mpm, at_base)
    if share > SHARE:
        yield Finding(
            Severity.NOTE,
            f"{100 * share:.0f} % of the continuum's granular temperature lies within a grain's "
            f"diameter of the base{which}: there it depends on the cells.",
            "Compare fields above the first grains; a figure of the whole column is one of its "
            "cells, too.",
            share,
            SHARE,
            reason="a quarter: so much the layer alone moves the whole, as far as T is asked to "
            "agree",
            of="mpm",
        )
