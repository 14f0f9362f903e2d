from compare.verdict.statements import Finding, statement
from compare.verdict.statements.elastic_energy_negligible import storing


@statement(
    text="Both are very small beside the dissipation by plastic flow and that in regime 4",
    source="Figure 6",
    unit="of the smaller dissipation",
    bound="≤ 0.1",
    order=6,
)
def stored_energies_below_dissipation(run):
    """The larger of the maxima over time of elastic and fluctuation energy, over the smaller of the
    two dissipations at the end: the sentence taken at its word. Very small is an order of
    magnitude.
    """
    held = {name: run.joules(name).max() for name in ("elastic", "fluctuation")}
    gone = {name: run.joules(f"dissipated_{name}")[-1] for name in ("plastic", "regime_4")}
    largest, smallest = max(held, key=held.__getitem__), min(gone, key=gone.__getitem__)
    ratio = held[largest] / gone[smallest] if gone[smallest] > 0.0 else float("inf")
    return Finding(
        ratio,
        ratio <= 0.1,
        run.energy_tau()[-1],
        f"{largest} energy over {smallest.replace('_', ' ')} dissipation",
    )


def holding():
    return storing(elastic=0.01, fluctuation=0.02)


def failing():
    """Negligible against the energy released, not against the plastic dissipation, 0.3 of it."""
    return storing(elastic=0.01, fluctuation=0.045)
