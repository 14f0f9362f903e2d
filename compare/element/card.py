"""The constants of a law, as a material card has them."""

import tomllib
from dataclasses import dataclass, fields, replace

from cases.errors import CaseError
from cases.programs import ROOT


@dataclass(frozen=True)
class Card:
    """The constants of a material card.

    Names, units and defaults are those of cases/schema.toml, table material. A card is of the law
    solid_fluid unless it says otherwise.
    """

    law: str
    bulk_stiffness: float
    shear_stiffness: float
    stiffness_exponent: float
    atmospheric_pressure: float
    stress_ratio: float
    critical_void_ratio: float
    critical_state_slope: float
    critical_state_form: str
    dilatancy: float
    dilatancy_form: str
    loose_void_ratio: float
    effective_restitution: float  # 0: derived from the grains
    tangential_restitution: float
    collision_time_factor: float
    correlation_length: str
    correlation_factor: float
    correlation_onset: float
    contact_share: float
    fabric_strain: float

    @classmethod
    def read(cls, name: str) -> "Card":
        """cases/materials/<name>.toml, completed by the schema's defaults."""
        schema = tomllib.loads((ROOT / "cases" / "schema.toml").read_text())["material"]
        path = ROOT / "cases" / "materials" / f"{name}.toml"
        if not path.exists():
            known = ", ".join(sorted(card.stem for card in path.parent.glob("*.toml")))
            raise CaseError(f"{path}: no such material card (known: {known})")
        written = {"law": "solid_fluid"} | tomllib.loads(path.read_text())["material"]
        return cls(
            **{
                field.name: written.get(field.name, schema[field.name].get("default"))
                for field in fields(cls)
            }
        )

    def with_values(self, **values) -> "Card":
        return replace(self, **values)
