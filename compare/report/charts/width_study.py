import numpy as np

from cases.style import DEM, INK
from compare.report.charts import chart, panels


@chart("Kernel width", order=8)
def width_study(comparison, narrow):
    study = comparison.width_study
    if study is None:
        return None
    dem = comparison.dem[0]
    scale = dem.case["geometry.gravity"] * dem.diameter
    stresses = "pressure" in study.means
    figure, axes = panels(3 if stresses else 2, narrow, height=3.2)
    axes[0].errorbar(
        study.widths, study.means["solid_fraction"], yerr=study.scatter, color=DEM, capsize=2
    )
    axes[0].lines[0].set_label("_solid fraction")
    axes[0].set(title="solid fraction, mean ± scatter", ylim=(0.0, None))
    for name, label, style in (
        ("granular_temperature_one_step", "one step, uncorrected", ":"),
        ("granular_temperature_two_step", "two steps, corrected", "--"),
        ("granular_temperature", "affine, corrected", "-"),
    ):
        axes[1].plot(study.widths, study.means[name] / scale, style, color=DEM, label=label)
    axes[1].set(title="granular temperature T/(g d)", ylim=(0.0, None))
    axes[1].legend(fontsize=8)
    if stresses:
        for name, label, style in (("pressure", "p", "-"), ("deviatoric_stress", "q", "--")):
            axes[2].plot(study.widths, study.means[name], style, color=DEM, label=label)
        axes[2].set(title="stress [Pa]", ylim=(0.0, None))
        axes[2].legend()
    for ax in axes:
        ax.axvline(comparison.mpm[0].case["compare.width"], color=INK, linewidth=0.8)
        ax.set(xlabel="kernel width w/d", xlim=(0.0, np.max(study.widths)))
    return figure, (
        f"Fields of the grains at t = {study.tau:.1f} √(H/g), averaged over one and the same core "
        "of the flow, against the kernel's width; the line marks the width used. A width is well "
        "chosen where the curves are flat."
    )
