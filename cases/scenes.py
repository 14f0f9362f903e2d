"""What a scene is, by the table [geometry] of its case: a collapsing column, a chute, a silo."""

from math import cos, radians, sin

from cases.case import Case
from cases.errors import CaseError


def is_chute(geometry: dict) -> bool:
    """Whether a layer flows down a plane; a case that does not say is a collapse."""
    return geometry.get("scene", "collapse") == "chute"


def is_silo(geometry: dict) -> bool:
    """Whether a column leaves a silo by an orifice in its bottom."""
    return geometry.get("scene", "collapse") == "silo"


def gravity_of(geometry: dict) -> tuple[float, float]:
    """Gravity along x and along -y [m/s2]; of a collapse all of it is along -y."""
    g = geometry["gravity"]
    if not is_chute(geometry):
        return 0.0, g
    angle = radians(geometry["inclination"])
    return g * sin(angle), g * cos(angle)


def floor_length(geometry: dict) -> float:
    """Of the base [m]: a chute's repeats after its length."""
    return geometry["length"] if is_chute(geometry) else geometry["floor_length"]


def refuse_chute(scene: Case, what: str):
    """Raises CaseError for a chute where `what` is made of collapses alone."""
    if is_chute(scene["geometry"]):
        raise CaseError(
            f"{scene.path}: geometry.scene is a chute ({what} of collapses, by their run-out and "
            "deposit) take ./grainpair run, or python3 -m compare.chute.study"
        )
