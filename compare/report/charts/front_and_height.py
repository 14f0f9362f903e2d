from cases.style import COLOUR, LABEL
from compare.report.charts import chart, panels
from compare.mapping.reductions import front, surface


@chart("Front and height", order=6)
def front_and_height(comparison, narrow):
    figure, axes = panels(2, narrow, height=3.0)
    for runs in (comparison.mpm, comparison.dem):
        for i, run in enumerate(runs):
            style = {
                "color": COLOUR[run.engine],
                "alpha": 1.0 if i == 0 else 0.3,
                "label": LABEL[run.engine] if i == 0 else f"_{run.name}",
            }
            axes[0].plot(run.tau(), front(run, 0.95) / run.length - 1.0, **style)
            name = f"_{str(style['label']).lstrip('_')}, 99.5 %"
            strays = style | {"label": name, "linestyle": ":", "linewidth": 1.0}
            axes[0].plot(run.tau(), front(run) / run.length - 1.0, **strays)
            axes[1].plot(
                run.tau(),
                [surface(run, k).max() / run.length for k in range(len(run.time))],
                **style,
            )
    for ax, label in zip(axes, ("run-out $x_{95}/L_0 - 1$", "height $h_{max}/L_0$")):
        ax.set(xlabel="t/√(H/g)", title=label, xlim=(0.0, None))
    axes[1].set_ylim(bottom=0.0)
    axes[0].legend()
    return figure, (
        "Front, behind which 95 % of the mass lies (dotted: 99.5 %, stray grains included), and "
        "highest point of the free surface, against time."
    )
