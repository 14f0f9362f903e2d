from typing import Any

from cases.style import COLOUR, LABEL
from compare.report.charts import chart, panels


def profile(run, values):
    """Mean over the column's width, less 3 d on either side, of a mapped field (ny, nx) at the
    release.
    """
    x = run.fields.grid.x
    inside = (x > 3 * run.diameter) & (x < run.length - 3 * run.diameter)
    return values[:, inside].mean(axis=1)


@chart("State at the release", order=8)
def initial_state(comparison, narrow):
    if not all(
        {"contact_stress", "stress_state"} & run.fields.values.keys() for run in comparison.first
    ):
        return None  # grains without contacts, as plain dumps are
    figure, axes = panels(2, narrow, height=3.0, sharey=True)
    case = comparison.mpm[0].case
    weight = case["grains.density"] * case["geometry.gravity"] * case["geometry.height"]
    for runs in (comparison.mpm, comparison.dem):
        for i, run in enumerate(runs):
            style: dict[str, Any] = {
                "color": COLOUR[run.engine],
                "alpha": 1.0 if i == 0 else 0.3,
                "label": LABEL[run.engine] if i == 0 else f"_{run.name}",
            }
            y = run.fields.grid.y / run.height
            column = (y > 0.0) & (y < 1.0)
            stress = run.fields[
                "contact_stress" if "contact_stress" in run.fields else "stress_state"
            ][0]
            solid = profile(run, run.fields["solid_fraction"][0])
            axes[0].plot(1.0 / solid[column] - 1.0, y[column], **style)
            axes[1].plot(profile(run, stress[..., 1, 1])[column] / weight, y[column], **style)
            axes[1].plot(
                profile(run, stress[..., 0, 0])[column] / weight,
                y[column],
                **{**style, "ls": "--", "label": f"_{style['label'].lstrip('_')}, along x"},
            )
    e0 = case["initial.void_ratio"]
    axes[0].set(xlabel="void ratio $e$", ylabel="y/H", xlim=(0.7 * e0, 1.3 * e0), ylim=(0.0, 1.0))
    axes[1].set(
        xlabel=r"$\sigma_{yy}$ (solid), $\sigma_{xx}$ (dashed) / $\rho_s g H$", xlim=(0.0, None)
    )
    axes[0].legend()
    start = {
        "nominal": (
            "The continuum starts from the nominal void ratio and lateral stress ratio of the case."
        ),
        "packing": (
            "The continuum starts from the packing: mass, void ratio and stress of the settled "
            "grains."
        ),
    }
    return figure, (
        f"{start[case['initial.state']]} Means over the column's width, less 3 d on either side, "
        "of the mapped fields at the release; within a kernel's width of floor and surface either "
        "reads low or high."
    )
