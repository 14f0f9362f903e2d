import numpy as np

from compare.metrics import metric
from compare.mapping.reductions import common_frames, example_run


@metric(
    unit="-",
    source="relative L1 norm; no mask, so that mass in the wrong place counts",
    of_pair=True,
)
def solid_fraction_error(mpm, dem):
    """Mean over all common instants of sum |phi_mpm - phi_dem| / sum (phi_mpm + phi_dem): 0 for
    equal fields, 1 for fields that do not overlap.
    """
    errors = []
    for i, k in common_frames(mpm, dem):
        a, b = mpm.fields["solid_fraction"][i], dem.fields["solid_fraction"][k]
        errors.append(abs(a - b).sum() / (a + b).sum())
    return float(np.mean(errors)) if errors else float("nan")


def example():
    return (
        (example_run(solid_fraction=[[[0.5, 0.1]]]), example_run(solid_fraction=[[[0.5, 0.3]]])),
        0.2 / 1.4,
        1e-12,
    )
