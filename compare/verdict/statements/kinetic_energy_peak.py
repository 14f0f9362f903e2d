import numpy as np

from compare.metrics.kinetic_energy_peak_time import kinetic_energy_peak_time
from compare.mapping.reductions import example_run
from compare.verdict.statements import Finding, statement


@statement(
    text="The kinetic energy peaks at about 1.1 √(H/g)",
    source="Figure 7",
    unit="√(H/g)",
    bound="1.1 ± 0.1",
    order=1,
)
def kinetic_energy_peak(run):
    """Time of the largest kinetic energy of the points (vertex of the parabola through the largest
    sample and its neighbours); 0.1 is what can be read off the paper's figure.
    """
    peak = kinetic_energy_peak_time(run)
    height = run.joules("kinetic").max() / run.released()
    return Finding(
        peak,
        abs(peak - 1.1) <= 0.1,
        peak,
        f"the peak is {100 * height:.1f} % of the energy released",
    )


def peaked(at):
    t = np.linspace(0.0, 5.0, 501)
    return example_run(
        energy={"time": t, "kinetic": np.exp(-((t - at) ** 2)), "potential": 2.0 - t / 5.0},
        engine="mpm",
    )


def holding():
    return peaked(1.15)


def failing():
    return peaked(1.42)
