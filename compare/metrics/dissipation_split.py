from compare.metrics import metric
from compare.mapping.reductions import example_run


@metric(
    unit="E0", source="energy histories; short contacts as in dem_reference/README.md", of_pair=True
)
def dissipation_split(mpm, dem):
    """Half the sum of the absolute differences of three shares of the released energy E0 at the
    end: dissipated in regime 4 (of the grains: by contacts shorter than the threshold),
    dissipated otherwise, and unaccounted for. Undefined where either side did not split its
    dissipation.
    """
    if not all(
        {"dissipated_regime_4", "dissipated_short"} & run.energy.keys() for run in (mpm, dem)
    ):
        return float("nan")

    def shares(run):
        apart = run.normalised("dissipated_regime_4")[-1] + run.normalised("dissipated_short")[-1]
        return (
            apart,
            run.normalised("dissipated")[-1] - apart,
            run.normalised("unaccounted")[-1],
        )

    return 0.5 * float(sum(abs(a - b) for a, b in zip(shares(mpm), shares(dem))))


def example():
    # Of one joule: 0.2 + 0.7 + 0.1 against 0.3 + 0.7 + 0.
    mpm = example_run(
        energy={
            "time": [0],
            "dissipated": [0.9],
            "dissipated_regime_4": [0.2],
            "unaccounted": [0.1],
        }
    )
    dem = example_run(
        energy={"time": [0], "dissipated": [1.0], "dissipated_short": [0.3], "unaccounted": [0.0]}
    )
    return (mpm, dem), 0.1, 1e-12
