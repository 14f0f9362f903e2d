from compare.verdict.statements import Finding, statement
from compare.verdict.statements.elastic_energy_negligible import largest_share, storing


@statement(
    text="The kinetic energy of fluctuations is negligible",
    source="Figure 6",
    unit="of the energy released",
    bound="≤ compare.margin_energy",
    order=5,
)
def fluctuation_energy_negligible(run):
    """Largest kinetic energy of fluctuations at any time over the energy released; negligible as
    for the elastic energy.
    """
    share, when, words = largest_share(run, "fluctuation")
    return Finding(share, share <= run.case["compare.margin_energy"], when, words)


def holding():
    return storing(fluctuation=0.01)


def failing():
    return storing(fluctuation=0.2)
