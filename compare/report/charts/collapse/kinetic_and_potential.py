from cases.style import INK, MPM
from compare.report.charts import chart, panels
from compare.metrics.kinetic_energy_peak_time import kinetic_energy_peak_time


@chart("Kinetic and potential energy", order=6)
def kinetic_and_potential(run, narrow):
    figure, axes = panels(2, narrow, height=3.0)
    tau, peak = run.energy_tau(), kinetic_energy_peak_time(run)
    weight = run.mass * run.case["geometry.gravity"] * run.height
    for ax, (name, label) in zip(
        axes, (("kinetic", "kinetic energy $E_k/MgH$"), ("potential", "potential energy $E_p/MgH$"))
    ):
        ax.plot(tau, run.joules(name) / weight, color=MPM)
        ax.set(xlabel="t/√(H/g)", title=label, xlim=(0.0, tau[-1]))
        ax.set_ylim(bottom=0.0)
    axes[0].axvspan(1.0, 1.2, color="#2c7a4b", alpha=0.15, lw=0.0, label="1.1 ± 0.1, the paper's")
    axes[0].axvline(peak, color=INK, lw=0.8, ls="--", label=f"peak at {peak:.2f}")
    axes[0].set_xlim(0.0, min(tau[-1], 5.0))
    axes[0].legend()
    return figure, (
        "Kinetic and potential energy of the points [Ceccato2019, Eqs. 17 and 18] (compare its "
        "Figure 7), over the weight times the column's height; potential energy is zero at the "
        "floor."
    )
