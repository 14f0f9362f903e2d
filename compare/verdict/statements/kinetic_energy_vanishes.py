from compare.metrics.kinetic_energy_peak_time import kinetic_energy_peak_time
from compare.verdict.statements import Finding, statement
from compare.verdict.statements.kinetic_energy_peak import peaked


@statement(
    text="The kinetic energy then tends to zero",
    source="Figure 7",
    unit="of its peak",
    bound="≤ 0.01",
    order=2,
)
def kinetic_energy_vanishes(run):
    """Kinetic energy at the end over its peak, the end being later than the peak; a hundredth is
    the width of a curve in a figure.
    """
    kinetic = run.joules("kinetic")
    left, end = kinetic[-1] / kinetic.max(), run.energy_tau()[-1]
    words = f"the run ends at {end:.2f} √(H/g) by: {run.attributes.get('end_reason', 'unknown')}"
    return Finding(left, left <= 0.01 and kinetic_energy_peak_time(run) < end, end, words)


def holding():
    return peaked(1.1)


def failing():
    return peaked(4.0)
