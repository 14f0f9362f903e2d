"""What the report's player packs comes back as exactly as the page says; what is left out or not
known is said.
"""

import base64
import re
import zlib
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from played import mapped, page, page_of, pair, rewrite  # noqa: F401
from synthetic import write_pair, write_run

from compare.report import player
from compare.report.player import packing, tracks


def unpacked(channel: packing.Channel) -> np.ndarray:
    """Codes (frames, count), read as packing.py describes them and by none of its code."""
    raw = zlib.decompress(base64.b64decode(channel.data))
    steps = np.frombuffer(raw, np.uint8).astype(np.int64)
    if channel.bits == 16:
        high, low = np.split(steps, 2)
        steps = 256 * high + low
    return np.cumsum(steps.reshape(channel.frames, channel.count), axis=0) % 2**channel.bits


# packing


@settings(deadline=None)
@given(
    arrays.arrays(
        st.sampled_from([np.uint8, np.uint16]), st.tuples(st.integers(1, 6), st.integers(1, 40))
    )
)
def test_codes_come_back_unchanged(codes):
    channel = packing.encode(codes)
    assert channel.bits == 8 * codes.itemsize
    assert np.array_equal(unpacked(channel), codes)


def test_other_codes_are_refused():
    with pytest.raises(TypeError, match="float64"):
        packing.encode(np.zeros((2, 2)))


def test_places_come_back_within_what_is_said():
    low, high = -0.01, 0.29
    x = np.random.default_rng(3).uniform(low, high, (5, 4000))
    x[0, :2] = low, high
    x[1, 7] = np.nan
    codes = packing.places(x, low, high)
    back = low + (high - low) * codes.astype(float) / packing.LAST
    error = np.abs(back - x)
    assert codes[1, 7] == packing.ABSENT and np.sum(codes == packing.ABSENT) == 1
    assert np.nanmax(error) <= packing.place_error(low, high) * (1 + 1e-9)
    assert np.nanmax(error) > 0.9 * packing.place_error(low, high)  # no more is promised than held


@pytest.mark.parametrize("log, low, high", [(False, 0.5, 1.4), (True, 1e-6, 0.1)])
def test_values_come_back_within_half_a_step(log, low, high):
    scale: Any = np.log if log else np.array
    back: Any = np.exp if log else np.array
    values = back(np.random.default_rng(4).uniform(scale(low), scale(high), 3000))
    codes = packing.levels(values, low, high, log).astype(float)
    found = scale(low) + (scale(high) - scale(low)) * (codes - 1) / packing.STEPS
    half = 0.5 * (scale(high) - scale(low)) / packing.STEPS
    assert 0.9 * half < np.max(np.abs(found - scale(values))) <= half * (1 + 1e-9)
    beyond = np.array([0.1 * low, 10 * high, np.nan, 0.0])
    assert packing.levels(beyond, low, high, log).tolist() == [1, 255, packing.UNKNOWN, 1]


@given(
    st.lists(st.tuples(st.integers(2, 3000), st.integers(1, 200_000)), min_size=2, max_size=2),
)
def test_no_pair_is_too_large_for_its_bytes(sizes):
    budget = packing.BUDGET
    allowed = packing.allowances([frames * count for frames, count in sizes], budget)
    taken = 0
    for (frames, count), share in zip(sizes, allowed):
        by_frame, by_particle = packing.thinning(frames, count, share)
        kept = len(tracks.kept_frames(frames, by_frame)), len(tracks.drawn(count, by_particle))
        assert kept[0] >= min(frames, packing.FEWEST_FRAMES)
        if frames * count <= share:
            assert (by_frame, by_particle) == (1, 1)
        # one more of each than its share, where it does not divide
        taken += 4 * packing.PER_PARTICLE * (kept[0] * (kept[1] - 1)) // 3
    assert taken <= budget
    if sum(frames * count for frames, count in sizes) <= 3 * budget // 4 // packing.PER_PARTICLE:
        assert allowed == [frames * count for frames, count in sizes]


# what is read, and what is said of it


def test_the_page_holds_what_the_files_hold(pair):  # noqa: F811
    """Each place within the rounding that the page states, each speed within half a step."""
    run = pair.dem[0]
    track = tracks.read(run, 10**9)
    box, _ = player.bounds([tracks.read(pair.mpm[0], 10**9), track], run)
    known = {q.name: q for q in player.quantities(run, [track])}
    channels = player.side(track, list(known.values()), box)["channels"]
    for k in (0, 13, 30):
        for axis, (low, high), component in zip("xy", box, (0, 1)):
            codes = unpacked(packing.Channel(**channels[axis]))[k]
            back = low + (high - low) * codes / packing.LAST
            error = np.max(np.abs(back - run.clouds[k].x[:, component]))
            # tracks are of single precision
            assert error <= packing.place_error(low, high) + 1e-7 * (high - low)
        speed = np.linalg.norm(run.clouds[k].v, axis=1)
        codes = unpacked(packing.Channel(**channels["speed"]))[k]
        step = known["speed"].high / packing.STEPS
        inside = speed < known["speed"].high
        assert np.max(np.abs((codes - 1) * step - speed)[inside]) <= 0.5001 * step


def test_grains_are_followed_by_their_ids(tmp_path):
    """Whatever their order in a frame; one that is not in a frame is nowhere there."""
    write_pair(tmp_path, mpm={"frames": 3}, dem={"frames": 3})
    before = tracks.read(mapped(tmp_path).dem[0], 10**9)
    count = before.x.shape[1]
    order = np.random.default_rng(5).permutation(count)[1:]  # the first of these is gone
    with h5py.File(tmp_path / "dem.h5", "a") as f:
        cloud = f["data/100/particles/cloud"]
        rewrite(cloud, count, order)
    after = tracks.read(mapped(tmp_path).dem[0], 10**9)
    gone = np.setdiff1d(np.arange(count), order)
    assert after.followed and np.isnan(after.x[1, gone]).all()
    assert np.array_equal(np.delete(after.x, gone, axis=1), np.delete(before.x, gone, axis=1))


def test_without_ids_frames_of_other_numbers_are_not_mixed(tmp_path):
    write_pair(tmp_path, mpm={"frames": 3}, dem={"frames": 3})
    with h5py.File(tmp_path / "dem.h5", "a") as f:
        for step in ("0", "100", "200"):
            del f[f"data/{step}/particles/cloud/id"]
    assert tracks.read(mapped(tmp_path).dem[0], 10**9).followed  # a row is a grain
    with h5py.File(tmp_path / "dem.h5", "a") as f:
        cloud = f["data/200/particles/cloud"]
        rewrite(cloud, len(cloud["mass"]), np.arange(5, len(cloud["mass"])))
    c = mapped(tmp_path)
    track = tracks.read(c.dem[0], 10**9)
    assert not track.followed and track.ids is None
    built = player.build(c)
    assert "no ids: their frames are shown as they are" in " ".join(built.notes)
    assert '"id": "the file has none"' in built.data


def test_what_a_side_does_not_know_is_said(pair):  # noqa: F811
    grains, points = (tracks.read(run, 10**9) for run in (pair.dem[0], pair.mpm[0]))
    assert grains.unknown == {"regime": "grains have none", "pressure": "the file has no contacts"}
    assert points.unknown == {"regime": "the file does not tell it"}
    assert player.build(pair).unknown == ("regime",)
    assert set(points.values) == {"speed", "void_ratio", "granular_temperature", "pressure"}


def test_what_is_left_out_is_said(pair):  # noqa: F811
    whole = " ".join(player.build(pair).notes)
    assert not re.search(r"\d+ is (here|shown)", whole)
    budget = 4 * packing.PER_PARTICLE * 31 * (1600 + 3125) // 3 // 4  # for a quarter of all
    built = player.build(pair, budget)  # half of it for either side: 1600/591, 3125/591
    assert "One grain in 6 is shown, drawn at random once." in built.notes
    assert re.search(r"One point in 3 is shown.*cover the same area", " ".join(built.notes))
    assert len(built.data) < len(player.build(pair).data) / 2


def test_one_instant_is_nothing_to_play(tmp_path):
    write_pair(tmp_path, mpm={"frames": 3}, dem={"frames": 3})
    write_run(tmp_path / "dem.h5", "dem", frames=1, seed=2)
    built = player.build(mapped(tmp_path))
    assert built.missing == "dem.h5 holds no two instants whose times are told"
    assert built.missing in page_of(built, tmp_path / "page.html").read_text()


def test_without_three_js_the_page_says_so(pair, monkeypatch):  # noqa: F811
    monkeypatch.setattr(player, "THREE", Path("/nowhere/three.min.js"))
    assert "(libjs-three)" in player.build(pair).missing


def test_the_page_is_small_and_asks_for_nothing(page):  # noqa: F811
    text = page.read_text()
    assert len(text) < 3_000_000  # 15 MB are allowed, the charts take up to five
    bare = re.sub(r'data:[^"]*', "", text)
    assert not re.findall(r'(?:src|href|srcset)="(?!data:|#)', text)
    assert "http://" not in bare and "https://" not in bare
