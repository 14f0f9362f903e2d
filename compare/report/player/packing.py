"""Numbers as the page holds them: quantised, as differences in time, deflated, in base64.

A channel holds frames of one length. Its codes are whole numbers of 8 or 16 bits; from the second
frame on, the difference to the frame before (modulo 2^8 or 2^16) is stored in their place, which is
small for what moves little. Of 16 bits all high bytes stand before all low ones, which deflates
better. `decode` in player.js is the way back.
"""

import base64
import zlib
from dataclasses import dataclass

import numpy as np

LAST = 65534  # the highest code of a place; the one above says that there is none
ABSENT = 65535
STEPS = 254  # of a value, from code 1 to 255; code 0 says that it is not known
UNKNOWN = 0

# Bytes that a particle takes in a frame before deflation: x and y of 16 bits, the depth of 8, five
# values of 8. Base64 makes four of three.
PER_PARTICLE = 10
BUDGET = 10_000_000  # bytes of the page, the most that particles may take even if nothing deflates
FEWEST_FRAMES = 60  # frames are thinned out before particles are, but not below


@dataclass(frozen=True)
class Channel:
    """A packed array of shape (frames, count): `bits` of its codes, `data` in base64."""

    bits: int
    frames: int
    count: int
    data: str


def encode(codes: np.ndarray) -> Channel:
    """Packs codes (frames, count), uint8 or uint16, without loss. Raises TypeError for others."""
    if codes.dtype not in (np.uint8, np.uint16):
        raise TypeError(f"codes are {codes.dtype} (neither uint8 nor uint16)")
    steps = codes.copy()
    steps[1:] -= codes[:-1]  # modulo, as unsigned numbers are
    parts = [steps] if steps.itemsize == 1 else [steps >> 8, steps & 255]
    raw = b"".join(part.astype(np.uint8).tobytes() for part in parts)
    data = base64.b64encode(zlib.compress(raw, 9)).decode()
    return Channel(8 * codes.itemsize, len(codes), codes.shape[1], data)


def places(x: np.ndarray, low: float, high: float) -> np.ndarray:
    """Codes (uint16) of places between low and high [m], 0 to LAST; ABSENT where x is NaN.

    What comes back is off by (high - low)/LAST/2 at most; places beyond are put on the bound.
    """
    with np.errstate(invalid="ignore"):
        share = (x - low) / (high - low) if high > low else np.where(np.isnan(x), x, 0.0)
    codes = np.rint(LAST * np.clip(share, 0.0, 1.0))
    return np.where(np.isnan(codes), ABSENT, codes).astype(np.uint16)


def place_error(low: float, high: float) -> float:
    """The most that `places` moves a point by [m]."""
    return 0.5 * (high - low) / LAST


def depths(z: np.ndarray, low: float, high: float) -> np.ndarray:
    """Codes (uint8) of depths in the slab, which only say what hides what; 0 where z is NaN."""
    if not high > low:
        return np.zeros(z.shape, np.uint8)
    share = np.nan_to_num(np.clip((z - low) / (high - low), 0.0, 1.0))
    return np.rint(255 * share).astype(np.uint8)


def levels(values: np.ndarray, low: float, high: float, log: bool = False) -> np.ndarray:
    """Codes (uint8) of values: 1 for low and below to 255 for high and above, even steps of the
    value or of its logarithm; UNKNOWN where it is NaN.

    What comes back is off by half a step at most, where the value lies in the range.
    """
    if log:
        low, high = np.log(low), np.log(high)
        with np.errstate(divide="ignore", invalid="ignore"):
            values = np.log(np.where(values < 0.0, 0.0, values))
    share = np.clip((values - low) / (high - low), 0.0, 1.0)
    codes = 1.0 + np.rint(STEPS * share)
    return np.where(np.isnan(codes), UNKNOWN, codes).astype(np.uint8)


def allowances(sizes: list[int], budget: int = BUDGET) -> list[int]:
    """How many particles times frames each of the sides may have whose `sizes` these are, so that
    the page holds no more than `budget` bytes of them: all where that fits, else a fair share, of
    which a side that needs less leaves the rest to the other.
    """
    left = budget * 3 // 4 // PER_PARTICLE
    given = [0] * len(sizes)
    order = sorted(range(len(sizes)), key=lambda k: sizes[k])
    for done, k in enumerate(order):
        given[k] = min(sizes[k], left // (len(sizes) - done))
        left -= given[k]
    return given


def thinning(frames: int, particles: int, allowed: int) -> tuple[int, int]:
    """Of how many frames and of how many particles one is kept, so that no more than about
    `allowed` particles times frames are left.
    """
    if frames * particles <= allowed:
        return 1, 1
    frame_stride = max(1, min(-(-frames * particles // allowed), frames // FEWEST_FRAMES))
    kept = -(-frames // frame_stride) + (frame_stride > 1)  # the last one too
    return frame_stride, max(1, -(-kept * particles // allowed))
