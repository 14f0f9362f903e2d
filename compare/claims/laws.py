"""What is stated of laws in the grains' flow and in their collapses, from the tables of judge."""

import pandas as pd

from compare.commands.claims import ROOT
from compare.judge.outcome import regression

TABLES = ROOT / "cases" / "column_small" / "reference" / "judge"


def table(name: str) -> pd.DataFrame:
    return pd.read_csv(TABLES / f"{name}.csv", comment="#")


def told(headline: str, figure: str) -> float:
    return float(regression(table("outcome")).set_index("headline").loc[headline, figure])


def explained_centre() -> float:
    """Share of the variance of the centre of mass that the bias explains [-]."""
    return told("centre_of_mass_x", "explained")


def foretold_centre() -> float:
    """Root mean square of what a column left out is foretold wrong by, centre of mass [-]."""
    return told("centre_of_mass_x", "foretold")


def foretold_run_out() -> float:
    """The same of the run-out [of the final length]."""
    return told("run_out_95", "foretold")


def seed_bias() -> float:
    """Bias of mu_D of the full model with Table 1 [-]."""
    return float(table("overall").set_index("law").loc["solid_fluid, seed_table1", "bias of μ_D"])


def contact_deposit() -> float:
    """Error of the deposit of contact_share in the column kept aside [L0]."""
    rows = table("outcome").set_index(["scene", "law"])
    return float(rows.loc[("column_double", "contact_share, contact_mu05"), "error_deposit"])
