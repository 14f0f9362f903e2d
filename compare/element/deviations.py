"""How far the law is from the grains in an element test.

One row per observation and card, and a sentence of verdict.
"""

import numpy as np

from compare.element.blocks import Block
from compare.element.model import Law

# An error this small counts as agreement where the DEM scatter does not already explain it.
CLOSE = 0.20


def is_plain(quantity: str) -> bool:
    """Whether a block of this kind holds values themselves rather than their logarithms."""
    return quantity.endswith(("void ratio", "shear over pressure"))


def table(blocks: list[Block], models: dict[str, Law]) -> list[dict]:
    """Rows with quantity, point, card, dem, dem_scatter (standard error over seeds), model, error.

    Scatter and error are relative to the DEM value, of plain values absolute.
    """
    rows = []
    for block in blocks:
        for card, model in models.items():
            for label, measured, error, predicted in zip(
                block.labels, block.measured, block.error, block.predict(model)
            ):
                plain = is_plain(block.kind)
                rows.append(
                    {
                        "quantity": block.kind,
                        "point": label,
                        "card": card,
                        "dem": measured if plain else np.exp(measured),
                        "dem_scatter": error,
                        "model": predicted if plain else np.exp(predicted),
                        "error": predicted - measured if plain else np.expm1(predicted - measured),
                    }
                )
    return [
        {
            key: float(value) if isinstance(value, np.floating) else value
            for key, value in row.items()
        }
        for row in rows
    ]


def verdicts(rows: list[dict]) -> list[str]:
    """One sentence per quantity and card.

    How many points agree, the median error, the worst and where.
    """
    sentences = []
    told = [row for row in rows if not np.isnan(row["model"])]  # a law may have no answer to some
    for quantity, card in dict.fromkeys((row["quantity"], row["card"]) for row in told):
        chosen = [row for row in told if (row["quantity"], row["card"]) == (quantity, card)]
        plain = is_plain(quantity)
        close = 0.1 * CLOSE if plain else CLOSE
        good = sum(abs(row["error"]) <= max(close, 2 * row["dem_scatter"]) for row in chosen)
        worst = max(
            chosen, key=lambda row: abs(row["error"]) if plain else abs(np.log1p(row["error"]))
        )
        median, scatter = (
            np.median([abs(row[key]) for row in chosen]) for key in ("error", "dem_scatter")
        )

        def say(value, signed=False):
            if plain:
                return f"{value:+.3f}" if signed else f"{value:.3f}"
            if signed and not -0.5 < value < 1:
                return f"a factor {1 + value:.2g}"
            return f"{value:+.0%}" if signed else f"{value:.0%}"

        word = (
            "agrees"
            if good == len(chosen)
            else "disagrees"
            if good < len(chosen) / 2
            else "agrees in part"
        )
        sentences.append(
            f"{quantity}, {card}: {word} ({good} of {len(chosen)} points within {say(close)} or "
            f"twice the DEM scatter); median error {say(median)} against a DEM scatter of "
            f"{say(scatter)}; worst {say(worst['error'], signed=True)} at {worst['point']}."
        )
    return sentences
