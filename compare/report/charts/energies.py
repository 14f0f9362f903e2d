from cases.style import COLOUR, LABEL
from compare.report.charts import chart, panels

PANELS = (
    ("kinetic", "kinetic energy of the mean motion $E_k/E_0$"),
    ("potential", "potential energy left $(E_p - E_p^{end})/E_0$"),
    ("dissipated", "energy dissipated $D/E_0$"),
)


@chart("Energies", order=5)
def energies(comparison, narrow):
    if not comparison.dem[0].reference_energy > 0.0:
        return None  # nobody knows the energy that the grains release
    figure, axes = panels(3, narrow, height=3.0)
    for ax, (name, label) in zip(axes, PANELS):
        for runs in (comparison.mpm, comparison.dem):
            for i, run in enumerate(runs):
                values = run.mean_motion() if name == "kinetic" else run.normalised(name)
                if name == "potential":
                    values = values - values[-1]
                ax.plot(
                    run.energy_tau(),
                    values,
                    color=COLOUR[run.engine],
                    alpha=1.0 if i == 0 else 0.3,
                    label=LABEL[run.engine] if i == 0 else f"_{run.name}",
                )
        ax.set(xlabel="t/√(H/g)", title=label, xlim=(0.0, None))
        ax.set_ylim(bottom=min(0.0, ax.get_ylim()[0]))
    axes[0].legend()
    scatter = (
        " Faint lines are the other runs of the ensemble."
        if len(comparison.dem) + len(comparison.mpm) > 2
        else ""
    )
    return figure, (
        "Kinetic energy of the mean motion, which leaves the fluctuations of the grains out, "
        "potential energy above its end value, and physically dissipated energy, all over the "
        "energy E0 that the grains release." + scatter
    )
