"""The energy budget of a run: what the released energy has become, account by account.

Totals and times compare one to one between the engines. The accounts of dissipation do not: the
grains' contacts know normal and tangential work, the continuum knows plastic flow and regime 4
dissipation, and that of enduring contacts in a law that has them; they stand side by side and are
never equated by name. Numerical losses and residuals are accounts of their own.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Account:
    name: str
    kind: str  # "held", "dissipated" or "numerical"
    values: np.ndarray  # (times,), in units of the reference energy


ACCOUNTS = {
    "mpm": (
        ("plastic", "dissipated", "dissipated_plastic"),
        ("in regime 4", "dissipated", "dissipated_regime_4"),
        ("enduring contacts", "dissipated", "dissipated_contact"),
        ("at walls", "dissipated", "dissipated_wall"),
        ("transfer loss", "numerical", "loss_transfer"),
        ("time integration", "numerical", "loss_time_integration"),
        ("mixing of void ratios", "numerical", "loss_mixing"),
        ("detached points", "numerical", "loss_detached"),
        ("conduction", "numerical", "loss_conduction"),
    ),
    "dem": (
        ("normal", "dissipated", "dissipated_normal"),
        ("tangential", "dissipated", "dissipated_tangential"),
        ("rolling", "dissipated", "dissipated_rolling"),
        ("at walls", "dissipated", "dissipated_wall"),
    ),
}


def mean_and_fluctuating(run) -> tuple[np.ndarray, np.ndarray]:
    """Kinetic energy of the mapped flow, 1/2 rho V^2, and of the fluctuation about it, at the
    frames [reference energy].

    The two add up to the cloud's kinetic energy exactly: 1/2 sum m v^2 phi = 1/2 rho V^2 + 1/2
    tr(kinetic stress).
    """
    grid = run.fields.grid
    scale = run.mass_scale / run.reference_energy
    rho, V = run.fields["density"], np.nan_to_num(run.fields["velocity"])
    mean = 0.5 * scale * grid.integral(rho * (V**2).sum(axis=-1))
    fluctuating = (
        0.5 * scale * grid.integral(np.trace(run.fields["kinetic_stress"], axis1=-2, axis2=-1))
    )
    return mean, fluctuating


def split_kinetic(run) -> list[Account]:
    """The kinetic energy, divided as the mapped frames divide it."""
    mean, fluctuating = mean_and_fluctuating(run)
    kinetic = run.normalised("kinetic")
    share = np.interp(
        run.energy["time"], run.time, fluctuating / np.maximum(mean + fluctuating, 1e-300)
    )
    return [
        Account("kinetic, mean flow", "held", (1.0 - share) * kinetic),
        Account("kinetic, fluctuating", "held", share * kinetic),
    ]


def budget(run, split: bool = True) -> list[Account]:
    """Accounts over run.energy_tau(), in the order they are stacked, the kinetic energy split by
    the mapped fields or whole; with the released energy they add up to what was there at release,
    except for the residual, which is the last account.
    """
    potential = run.normalised("potential")
    held = [Account("potential", "held", potential - potential[-1])]
    held += split_kinetic(run) if split else [Account("kinetic", "held", run.normalised("kinetic"))]
    held += [
        Account("rotational", "held", run.normalised("rotational")),
        Account("elastic", "held", run.normalised("elastic")),
    ]
    if run.engine == "mpm":  # the grains' fluctuation is part of their kinetic energy
        held.append(Account("granular temperature", "held", run.normalised("fluctuation")))
    gone = [
        Account(name, kind, run.normalised(column))
        for name, kind, column in ACCOUNTS[run.engine]
        if column in run.energy
    ]
    if not gone:  # an engine that was not asked to split its dissipation
        gone = [Account("all mechanisms", "dissipated", run.normalised("dissipated"))]
    if "gate_work" in run.energy:  # brought in from outside: below zero
        held.append(Account("work of the gate", "held", -run.normalised("gate_work")))
    if "lost" in run.energy:  # what vanished with imported grains was dissipated by none
        gone.append(Account("lost with grains", "numerical", run.normalised("lost")))
    # What imported points do not tell is not a number; it goes into the residual.
    accounts = [a for a in held + gone if np.any(np.nan_to_num(a.values))]
    total = sum((a.values for a in accounts), np.zeros_like(potential))
    accounts.append(Account("residual", "numerical", total[0] - total))
    return accounts
