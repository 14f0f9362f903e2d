import numpy as np

from compare.mapping.reductions import example_run
from compare.verdict.statements import Finding, statement


def largest_share(run, account):
    """Largest value of an account over the energy released, when it comes [sqrt(H/g)], and both as
    words beside the dissipations.
    """
    values, tau = run.joules(account) / run.released(), run.energy_tau()
    k = int(np.argmax(values))
    gone = {
        kind: run.joules(f"dissipated_{kind}")[-1] / run.released()
        for kind in ("plastic", "regime_4")
    }
    words = f"at {tau[k]:.2f} √(H/g)" + "".join(
        f"; {values[k] / share:.2g} of the {kind.replace('_', ' ')} dissipation at the end"
        for kind, share in gone.items()
        if share > 0.0
    )
    return float(values[k]), float(tau[k]), words


@statement(
    text="The elastic energy stored is negligible",
    source="Figure 6",
    unit="of the energy released",
    bound="≤ compare.margin_energy",
    order=4,
)
def elastic_energy_negligible(run):
    """Largest elastic energy stored at any time over the energy released. Negligible is what the
    comparison of two runs could not tell apart: less than the case's margin on energy.
    """
    share, when, words = largest_share(run, "elastic")
    return Finding(share, share <= run.case["compare.margin_energy"], when, words)


def storing(**shares):
    t = np.linspace(0.0, 5.0, 101)
    bump = {name: share * t * np.exp(1.0 - t) for name, share in shares.items()}
    gone = {"dissipated_plastic": 0.3 * t / 5.0, "dissipated_regime_4": 0.7 * t / 5.0}
    return example_run(energy={"time": t, "potential": 2.0 - t / 5.0} | gone | bump, engine="mpm")


def holding():
    return storing(elastic=0.01)


def failing():
    return storing(elastic=0.2)
