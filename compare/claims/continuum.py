"""What the continuum's solver states about itself, measured on the smallest column."""

from pathlib import Path

import h5py
import numpy as np

from cases.programs import ROOT, own, program
from cases.scratch import temporary
from cases.stages import Stage, run_stages
from compare.commands.claims import metrics
from compare.mapping.runs import open_run
from compare.metrics.centre_of_mass_x import centre_of_mass_x

SCENES = ("column", "column_ci", "column_shallow", "column_small", "column_tall", "cylinder")


def ledger_drift() -> float:
    """Largest change of the sum of all energy accounts over a run, over the energy released. [-]"""
    metrics("column_ci")
    with h5py.File(own("runs", "claims", "column_ci") / "mpm.h5") as file:
        energy = {name: column[()] for name, column in file["energy"].items()}
    total = sum(
        energy[name]
        for name in ("kinetic", "potential", "elastic", "fluctuation", "dissipated", "unaccounted")
    )
    return float(np.ptp(total) / (energy["potential"][0] - energy["potential"][-1]))


def column(folder: Path, name: str, *sets: str) -> Path:
    """The result of a scene, with assignments."""
    result = folder / f"{len(list(folder.iterdir()))}.h5"
    words = [word for assignment in sets for word in ("--set", assignment)]
    command = [program("mpm_run"), ROOT / "cases" / name, *words, "-o", result]
    run_stages([Stage(name, command)], quiet=True)
    return result


def refinement_drift() -> float:
    """Centre of mass of the smallest column with Drucker-Prager on 40 cells in the height, over
    that on 10, less one. [-]
    """
    with temporary() as folder:
        coarse, fine = (
            centre_of_mass_x(
                open_run(
                    column(folder, "column_ci", "material.law=drucker_prager", f"mpm.cell_size={h}")
                )
            )
            for h in (0.002, 0.0005)
        )
    return abs(fine / coarse - 1.0)


def worst_loss() -> float:
    """The largest numerical loss of the shipped scenes, over the energy each releases. [-]"""
    losses = []
    with temporary() as folder:
        for name in SCENES:
            with h5py.File(column(folder, name)) as file:
                potential, lost = (file["energy"][key][()] for key in ("potential", "unaccounted"))
            losses.append(abs(lost[-1]) / (potential[0] - potential[-1]))
    return float(max(losses))


def outside_regime_4() -> float:
    """Share of the account dissipated_regime_4 that points add to while they are in another
    regime, on the smallest column with the full model: by their regime at the end of each frame,
    which are dense enough that the start of it gives 1e-3 more. [-]
    """
    full = ["law=solid_fluid", "card=dem_mu05", "bulk_stiffness=53.12", "shear_stiffness=57.34"]
    sets = [f"material.{word}" for word in full]
    sets += ["mpm.young_modulus=5e6", "time.frame_interval=0.05"]
    with temporary() as folder:
        before, outside, all_of_it = None, 0.0, 0.0
        for cloud in open_run(column(folder, "column_ci", *sets)).clouds:
            now = cloud.mass * cloud.state["regime_4_dissipation"]
            gained = now - (now if before is None else before)
            outside += gained[cloud.state["regime"] != 4].sum()
            all_of_it += gained.sum()
            before = now
    return float(outside / all_of_it)
