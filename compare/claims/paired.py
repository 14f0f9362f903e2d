"""What holds for every paired run, measured on the smallest."""

from compare.commands.claims import metrics


def mapped_mass_error() -> float:
    """Largest relative difference between a cloud's mass and the integral of its mapped density.
    [-]
    """
    m = metrics("column_ci")
    return max(abs(m["mapped_mass"][engine] / m["mass"][engine] - 1) for engine in ("mpm", "dem"))


def unaccounted_by_the_grains() -> float:
    """What the grains' energy balance leaves open, over the energy released. [-]"""
    m = metrics("column_ci")
    return abs(m["unaccounted_energy"]["dem"])
