"""The figures of a chute in words."""

WORDS = {
    "solid_fraction": ("solid fraction of the core", "-"),
    "temperature_ratio": ("T/(shear rate d)^2 of the core", "-"),
    "inertial_number": ("inertial number of the core", "-"),
    "stress_ratio": ("shear over normal stress of the core", "-"),
    "mean_velocity": ("mean velocity", "m/s"),
    "bagnold": ("exponent of the velocity profile", "-"),
    "depth": ("depth", "d"),
    "normal_balance": ("normal stress against the weight above, at worst", "-"),
    "shear_balance": ("shear stress against the pull above, at worst", "-"),
    "crowding": ("more solid than the points' own void ratios tell", "-"),
    "change": ("change of the mean velocity over the time averaged", "-"),
}


def lines(metrics: dict) -> list[str]:
    """The figures of both sides, for a terminal."""
    out = [f"{'':<52}{'MPM':>12}{'DEM':>20}{'MPM/DEM - 1':>14}"]
    for name, (doc, unit) in WORDS.items():
        one = metrics[name]
        shown = ["-" if one[k] is None else f"{one[k]:.4g}" for k in ("mpm", "dem")]
        shown[1] += f" ± {one['dem_std']:.1g}" if "dem_std" in one else ""
        off = one["relative_difference"]
        share = "-" if off is None else f"{100 * off:+.1f} %"
        out.append(f"{doc + ' [' + unit + ']':<52}{shown[0]:>12}{shown[1]:>20}{share:>14}")
    return out


# Figures that say what a flow is; the others say how good a side is.
STATE = (
    "solid_fraction",
    "temperature_ratio",
    "inertial_number",
    "stress_ratio",
    "mean_velocity",
    "bagnold",
)
