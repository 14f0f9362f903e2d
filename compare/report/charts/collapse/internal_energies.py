import numpy as np

from compare.report.charts import chart, panels

LINES = (
    ("dissipated_regime_4", "in regime 4, dissipated", "#c8561b"),
    ("dissipated_plastic", "plastic, dissipated", "#7a4bb3"),
    ("fluctuation", "fluctuation, stored", "#2c7a4b"),
    ("elastic", "elastic, stored", "#1f5fa8"),
)
CONTACT = ("dissipated_contact", "by enduring contacts, dissipated", "#8a6d1d")


@chart("Internal energies", order=5)
def internal_energies(run, narrow):
    figure, axes = panels(2, narrow, height=3.1)
    tau = run.energy_tau()
    # only a law with a contact share has that account
    extra = (CONTACT,) if np.any(run.normalised(CONTACT[0])) else ()
    for ax, lines in zip(axes, ((*extra, *LINES), LINES[2:])):
        for name, label, colour in lines:
            ax.plot(tau, 100.0 * run.normalised(name), color=colour, label=label)
        ax.set(xlabel="t/√(H/g)", xlim=(0.0, tau[-1]), ylabel="% of the energy released")
        ax.set_ylim(bottom=0.0)
        ax.legend(loc="best")
    axes[0].set_title("all")
    axes[1].set_title("the stored ones alone")
    return figure, (
        "The kinds of internal energy (compare [Ceccato2019], Figure 6): dissipated by "
        "collisions and by plastic flow, accumulated, and stored as fluctuations and elastically, "
        "over the potential energy released until the end. What the numerics lost is in none of "
        "them; the budget below shows it."
    )
