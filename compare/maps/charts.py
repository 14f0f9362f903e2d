"""Figures of a map: fields, profiles, momentum balance, widths. Each returns heading, sentences and
SVG.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from cases.reading import opened
from compare.maps.profiles import FLAT, Balance, Profile, WidthStudy
from compare.maps.source import AXES, Source
from compare.report.charts.maps import STILL
from compare.study.charts import STUDY_STYLE, save
from compare.study.page import Figure

FIELDS = {
    "solid_fraction": "solid fraction",
    "speed": "speed [m/s]",
    "granular_temperature": "T [m²/s²]",
    "pressure": "p [Pa]",
    "stress_ratio": "q/p",
}
# What is less than this share of the scale's upper end is at rest to the eye, and grey.
STILL_BELOW = {"speed": 0.02, "granular_temperature": 0.001}
PROFILES = {
    "solid_fraction": "solid fraction",
    "velocity": "velocity [m/s]",
    "temperature": "T [m²/s²]",
    "stress": "stress [Pa]",
    "stress_ratio": "q/p",
    "inertial_number": "I",
}


def fields(source: Source, path: Path, shown: list[int], labels: list[str], out: Path) -> Figure:
    """Maps of the fields of one source at some of the mapped frames, x to the right, y up."""
    with opened(path) as f:
        group, x, y = f[source.name], f["grid/x"][:], f["grid/y"][:]
        slab = "z" in f["grid"]
        maps = {name: [field(group, name, k) for k in shown] for name in FIELDS}
    present = {name: one for name, one in maps.items() if any(m is not None for m in one)}
    wide = np.ptp(x) > 1.5 * np.ptp(y)  # then frames stand side by side, else fields do
    across, down = (len(shown), len(present)) if wide else (len(present), len(shown))
    height = np.clip(9.0 / across * np.ptp(y) / max(np.ptp(x), 1e-30), 0.9, 4.0)
    with plt.rc_context(STUDY_STYLE):
        figure, axes = plt.subplots(
            down,
            across,
            figsize=(11.0, 0.8 + (0.3 + height) * down),
            sharex=True,
            sharey=True,
            squeeze=False,
            layout="constrained",
        )
        for (name, images), line in zip(present.items(), axes if wide else axes.T):
            limits, look = span(images), plt.get_cmap("viridis")
            if name in STILL_BELOW and limits[1] > 0.0:
                limits = (STILL_BELOW[name] * limits[1], limits[1])
                look = look.with_extremes(under=STILL)
            for image, ax, k in zip(images, line, shown):
                ax.set_title(labels[k], fontsize=8.5)
                if image is None:
                    ax.text(0.5, 0.5, "not told", transform=ax.transAxes, ha="center")
                    continue
                mesh = ax.pcolormesh(
                    x, y, image, rasterized=True, vmin=limits[0], vmax=limits[1], cmap=look
                )
                ax.set_aspect("equal")
                ax.grid(False)
            side = "right" if wide else "bottom"
            ends = "min" if name in STILL_BELOW else "neither"
            figure.colorbar(
                mesh, ax=line, label=FIELDS[name], location=side, shrink=0.9, extend=ends
            )
        for ax in axes[:, 0]:
            ax.set_ylabel("y [m]")
        for ax in axes[-1]:
            ax.set_xlabel("x [m]")
        words = [
            "Averaged with one kernel; only cells that hold a twentieth of the densest are shown. "
            + ("The layer at half the depth." if slab else "Averaged over z.")
            + " Speeds below 2 % of the scale's end and T below 0.1 % are grey: at rest."
        ]
        for name in FIELDS.keys() - present.keys():
            words.append(f"No {FIELDS[name].split(' [')[0]}: the file does not tell it.")
        return f"Fields: {source.name}", words, save(figure, out, {})


def field(group, name: str, k: int) -> np.ndarray | None:
    """(ny, nx); NaN where there is next to nothing."""
    if name == "speed":
        values = np.linalg.norm(group["velocity"][k], axis=-1)
    elif name in group:
        values = group[name][k]
    else:
        return None
    density = group["density"][k]
    values = np.where(density > 0.05 * density.max(), values, np.nan)
    values = values[len(values) // 2] if values.ndim == 3 else values
    return values if np.isfinite(values).any() else None


def span(images: list) -> tuple[float, float]:
    """Limits that single cells do not decide."""
    values = np.concatenate([image[np.isfinite(image)] for image in images if image is not None])
    low, high = np.quantile(values, [0.005, 0.995])
    return float(low), float(high if high > low else low + 1.0)


def profiles(
    source: Source, found: list[Profile], shown: list[int], labels: list[str], along: str, out: Path
) -> Figure:
    with plt.rc_context(STUDY_STYLE):
        figure, axes = plt.subplots(
            2, 3, figsize=(11.0, 6.4), sharey=True, squeeze=False, layout="constrained"
        )
        shades = plt.get_cmap("viridis")(np.linspace(0.0, 0.85, len(shown)))
        for k, shade in zip(shown, shades):
            for ax, what in zip(axes.ravel(), PROFILES):
                for curve, style, word in curves(found[k], what, along):
                    label = f"{labels[k]} {word}".strip()
                    ax.plot(curve, found[k].place, style, color=shade, label=label, lw=1.2)
        for ax, (what, label) in zip(axes.ravel(), PROFILES.items()):
            ax.set_xlabel(label)
            if not ax.lines:
                ax.text(0.5, 0.5, "not told", transform=ax.transAxes, ha="center")
            elif len(ax.lines) <= 9:
                ax.legend(fontsize=6.5)
            positive = any((np.nan_to_num(line.get_xdata()) > 0.0).any() for line in ax.lines)
            if what == "inertial_number" and positive:
                ax.set_xscale("log")
        for line in axes:
            line[0].set_ylabel(f"{along} [m]")
        words = [
            f"Averages over all that is not {along}; numbers in profiles.csv.",
            "T by mass, Σ m v'²/(3 Σ m); dashed by number of grains, Σ v'²/(3 N), where sizes "
            "differ. Both are about a local affine fit, corrected for the grain's own share in it.",
            "I = γ̇ d/√(p/ρ_s), d = Σd⁴/Σd³ of the grains that move.",
        ]
        return f"Profiles: {source.name}", words, save(figure, out, {})


def curves(profile: Profile, what: str, along: str):
    """(values, style, word) of what a panel shows."""
    rho = profile["density"]
    there = rho > 0.05 * rho.max()

    def clean(values):
        return np.where(there, values, np.nan)

    if what == "velocity":
        for i, style in enumerate(("-", "--", ":")):
            yield clean(profile["velocity"][:, i]), style, AXES[i]
    elif what == "temperature":
        for name, style, word in (
            ("granular_temperature", "-", ""),
            ("granular_temperature_per_grain", "--", "per grain"),
            ("granular_temperature_state", ":", "of the law"),
        ):
            if name in profile:
                yield clean(profile[name]), style, word
    elif what == "stress":
        name = "stress_state" if "stress_state" in profile else "contact_stress"
        if name in profile:
            i = AXES.index(along)
            yield clean(profile[name][:, i, i]), "-", f"σ_{along}{along}"
            j = 0 if i else 1
            yield clean(profile[name][:, j, i]), "--", f"σ_{AXES[j]}{along}"
    elif what in profile:
        yield clean(profile[what]), "-", ""


def momentum(
    source: Source, found: list[Balance], labels: list[str], along: str, out: Path
) -> Figure:
    i = AXES.index(along)
    with plt.rc_context(STUDY_STYLE):
        figure, (left, right) = plt.subplots(
            1, 2, figsize=(11.0, 4.2), sharey=True, layout="constrained"
        )
        shades = plt.get_cmap("viridis")(np.linspace(0.0, 0.85, len(found)))
        for one, label, shade in zip(found, labels, shades):
            left.plot(one.residual[:, i] / one.scale, one.place, color=shade, lw=1.0, label=label)
            right.plot(one.stress, one.place, color=shade, lw=1.2, label=f"{label} stress")
            right.plot(one.carried, one.place, "--", color=shade, lw=1.0, label="weight carried")
        left.set(xlabel=f"(−∂σ + t + ρg)_{along} / max ρ|g|", ylabel=f"{along} [m]")
        right.set_xlabel(f"σ_{along}{along} [Pa]")
        left.legend(fontsize=7.5)
        right.legend(fontsize=7.5)
        words = [
            "Residual of the momentum balance with all stresses, ρVV, the force of walls and the "
            "weight: zero in a steady flow or at rest; what is left is acceleration, or a force "
            "that the file lacks. Fields are open at walls here, kernel Lucy of the same width.",
        ]
        for one, label in zip(found, labels):
            words.append(says(one, label, along))
        return f"Momentum balance: {source.name}", words, save(figure, out, {})


def says(one: Balance, label: str, along: str) -> str:
    closing = ", ".join(f"{a} {value:.2g}" for a, value in zip(AXES, one.closing))
    off, lacking = 100 * one.carrying, 100 * abs(one.unexplained)
    return (
        f"{label}: closing error in the bulk (root mean square over max ρ|g|) {closing}; the "
        f"stress differs from the weight that it carries by {off:.2g} % at most; "
        f"forces that the file lacks hold {lacking:.3g} % of the weight along {along}."
    )


def widths(study: WidthStudy, width: float, out: Path) -> Figure:
    with plt.rc_context(STUDY_STYLE):
        figure, ax = plt.subplots(figsize=(9.0, 4.2), layout="constrained")
        k = int(np.argmin(abs(study.widths - width)))
        for name, values in study.means.items():
            if np.isfinite(values[k]) and values[k] != 0.0:
                ax.plot(study.widths, values / values[k], "o-", ms=3, label=name.replace("_", " "))
        ax.axvline(width, color="#8a8f98", lw=0.8)
        ax.set(xlabel="kernel width w [d]", ylabel="mean over the core / at the width used")
        ax.set_ylim(0.5, 2.0)
        ax.legend(fontsize=7.5, loc="upper left", bbox_to_anchor=(1.01, 1.0))
        words = [
            "Mean over the same core of the profile, three diameters inside the dense part. Below "
            "the plateau single grains and layers show, above it surface, walls and gradients.",
            *(
                f"{name.replace('_', ' ')}: within {100 * FLAT:.0f} % from {low:g} to {high:g} d."
                for name, (low, high) in study.plateau.items()
            ),
        ]
        return f"Width of the kernel: {study.source}", words, save(figure, out, {})
