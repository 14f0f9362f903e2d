"""What the player can colour by: one range for both sides, stated beside it."""

import base64
from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_rgb

from compare.mapping.runs import Run
from compare.report.charts.collapse.regimes import COLOURS, WORDS
from compare.report.player.packing import levels
from compare.report.player.tracks import Track

TOP = 0.995  # quantile of both sides' values that a range without a bound of its own ends at
PALETTE = ("tab10", 10)  # for ids: as many colours as can be told apart


@dataclass(frozen=True)
class Quantity:
    """A quantity with the range of its codes [unit], even in the logarithm where `log`; `classes`
    are words for the values 0, 1, … of one without a range; `colours` (256, 3) uint8 by code.
    """

    name: str
    label: str
    unit: str
    low: float
    high: float
    log: bool
    colours: np.ndarray
    classes: tuple[str, ...] = ()
    note: str = ""

    def codes(self, track: Track) -> np.ndarray | None:
        """Codes (F, N) of a side, (1, N) of what does not change; None where nothing is known."""
        if self.name == "id":
            return None if track.ids is None else id_codes(track.ids)[None, :]
        if self.name not in track.values:
            return None
        values = track.values[self.name]
        if self.classes:
            return np.where(np.isnan(values), 0, values + 1).astype(np.uint8)
        return levels(values, self.low, self.high, self.log)

    def told(self) -> dict:
        """For the page: the colours as bytes in base64."""
        return {
            "name": self.name,
            "label": self.label,
            "unit": self.unit,
            "low": digits(self.low),
            "high": digits(self.high),
            "log": self.log,
            "classes": self.classes,
            "note": self.note,
            "colours": base64.b64encode(self.colours.tobytes()).decode(),
        }


def id_codes(ids: np.ndarray) -> np.ndarray:
    """A colour's code for each id (N,): neighbours in number, which often are in place, differ."""
    return (
        1 + (ids.astype(np.uint64) * np.uint64(2654435761) >> np.uint64(7)) % PALETTE[1]
    ).astype(np.uint8)


def table(colourmap: str) -> np.ndarray:
    """(256, 3) uint8: code 0 unused, 1 to 255 along the map."""
    along = np.concatenate([[0.0], np.linspace(0.0, 1.0, 255)])
    return np.rint(255 * colormaps[colourmap](along)[:, :3]).astype(np.uint8)


def listed(colours) -> np.ndarray:
    """(256, 3) uint8: the colours from code 1 on."""
    out = np.zeros((256, 3), np.uint8)
    out[1 : 1 + len(colours)] = np.rint(255 * np.array([to_rgb(c) for c in colours]))
    return out


def digits(value: float) -> str:
    """Two or three digits, with a power of ten where that is shorter."""
    if value == 0.0 or 1e-3 <= abs(value) < 1e5:
        return f"{value:.3g}"
    mantissa, _, power = f"{value:.1e}".partition("e")
    raised = str(int(power)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"{mantissa}·10{raised}"


def rounded_up(value: float) -> float:
    """To two digits, so that a legend can say it."""
    if not value > 0.0:
        return 1.0
    unit = 10.0 ** (np.floor(np.log10(value)) - 1)
    return float(np.ceil(value / unit - 1e-9) * unit)


def top(name: str, tracks: list[Track]) -> float:
    """The end of a range from 0 on that holds TOP of the values of each side."""
    known = [t.values[name][np.isfinite(t.values[name])] for t in tracks if name in t.values]
    return rounded_up(max((float(np.quantile(v, TOP)) for v in known if len(v)), default=0.0))


def quantities(dem: Run, tracks: list[Track]) -> list[Quantity]:
    """All of them, whether a side knows them or not. Ranges of e and T are those of the maps."""
    e0 = dem.case["initial.void_ratio"]
    unit_t = dem.case["geometry.gravity"] * dem.diameter
    words = tuple(word.replace("\n", "") for word in WORDS)
    return [
        Quantity("speed", "speed |v|", "m/s", 0.0, top("speed", tracks), False, table("cividis")),
        Quantity("void_ratio", "void ratio e", "–", 0.8 * e0, 2.0 * e0, False, table("viridis")),
        Quantity(
            "granular_temperature",
            "granular temperature T",
            "m²/s²",
            1e-4 * unit_t,
            10.0 * unit_t,
            True,
            table("magma"),
            note="logarithmic",
        ),
        Quantity(
            "pressure", "pressure p", "Pa", 0.0, top("pressure", tracks), False, table("plasma")
        ),
        Quantity(
            "regime", "regime of the law", "", 0.0, 4.0, False, listed(COLOURS), classes=words
        ),
        Quantity(
            "id",
            "id",
            "",
            0.0,
            PALETTE[1] - 1.0,
            False,
            listed(colormaps[PALETTE[0]].colors),
            note=f"{PALETTE[1]} colours dealt out by number, to follow single ones by",
        ),
    ]
