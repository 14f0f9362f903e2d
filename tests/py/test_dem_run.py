"""The grains' side of a run, end to end with the real LIGGGHTS, on the smallest column."""

import hashlib
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest

from cases.case import load
from cases.reading import attributes
from dem_reference import content, packing
from dem_reference.run import Progress, main

CASE = "cases/column_ci"
SHORT = ["--set", "time.maximum=1.0", "--quiet"]


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return tmp_path_factory.mktemp("packings")


@pytest.fixture(scope="module")
def whole(tmp_path_factory, store):
    """The case as it stands, from pouring to the end."""
    path = tmp_path_factory.mktemp("whole") / "dem.h5"
    assert main([CASE, "-o", str(path), "--packings", str(store), "--quiet"]) == 0
    return path


@pytest.fixture(scope="module")
def audited(tmp_path_factory, store, whole):
    """The collapse's livelier half, every step audited."""
    path = tmp_path_factory.mktemp("audited") / "dem.h5"
    words = ["--set", "time.maximum=1.5", "--set", "dem.audit_interval=1", "--quiet"]
    assert main([CASE, "-o", str(path), "--packings", str(store), *words]) == 0
    return path


def digest(path: Path) -> str:
    """Hash of every number of the frames and the energy history."""
    total = hashlib.sha256()
    with h5py.File(path) as file:
        for root in ("data", "energy", "packing"):
            file[root].visititems(
                lambda name, item: total.update(name.encode() + item[()].tobytes())
                if isinstance(item, h5py.Dataset)
                else None
            )
    return total.hexdigest()


def energies(path: Path) -> dict:
    with h5py.File(path) as file:
        return {name: values[()] for name, values in file["energy"].items()}


def released(energy: dict) -> float:
    return energy["potential"][0] - energy["potential"][-1]


def test_the_column_collapses(whole):
    """It spreads by more than half its length and loses potential energy, and no grain is lost."""
    with h5py.File(whole) as file:
        steps = sorted(file["data"], key=int)
        first, last = (file[f"data/{steps[k]}/particles/cloud"] for k in (0, -1))
        length = load(CASE)["geometry.length"]
        grains = first["kind"][()] == 1
        assert np.quantile(first["position/x"][()][grains], 0.98) < length
        assert np.quantile(last["position/x"][()][grains], 0.98) > 1.5 * length
        assert np.array_equal(first["id"][()], last["id"][()])
        assert grains.sum() == file["packing"].attrs["grains"]
    energy = energies(whole)
    assert np.all(np.isfinite([energy[name][-1] for name in energy]))
    assert 0 < energy["kinetic"].max() < released(energy) < energy["potential"][0]


def test_the_file_follows_the_contract(whole):
    with h5py.File(whole) as file:
        for name in (
            "openPMD",
            "engine_version",
            "commit",
            "seed",
            "case",
            "case_resolved",
            "command",
            "threads",
            "cpu_seconds",
            "wall_seconds",
            "time_scale",
            "end_reason",
        ):
            assert name in file.attrs, name
        told = attributes(file)
        assert told["case"] == Path(CASE, "case.toml").read_text()
        assert "LIGGGHTS" in told["engine_version"]
        for step in file["data"]:
            frame = file[f"data/{step}"]
            assert {"time", "dt", "timeUnitSI"} <= set(frame.attrs)
            cloud = frame["particles/cloud"]
            n = cloud["id"].shape[0]
            for record in ("position", "velocity", "angular_velocity"):
                for axis in "xyz":
                    assert cloud[f"{record}/{axis}"].shape == (n,)
                    assert cloud[f"{record}/{axis}"].attrs["unit"]
            assert cloud["positionOffset/x"].attrs["shape"] == n
            columns = ("first", "force/x", "dissipation")
            assert len({frame[f"contacts/{name}"].shape for name in columns}) == 1
        rows = {values.shape for values in file["energy"].values()}
        assert len(rows) == 1
        assert all({"unit", "doc"} <= set(values.attrs) for values in file["energy"].values())
        assert file["packing"].attrs["mass"] == pytest.approx(
            cloud["mass"][()][cloud["kind"][()] == 1].sum(), rel=1e-12
        )


def test_forces_stand_for_the_weight_at_release(whole):
    """The packing is at rest: base and walls carry the grains' weight.

    Contact forces know nothing else.
    """
    with h5py.File(whole) as file:
        frame = file["data/0"]
        cloud, contacts = frame["particles/cloud"], frame["contacts"]
        kind = dict(zip(cloud["id"][()], cloud["kind"][()]))
        first, second = contacts["first"][()], contacts["second"][()]
        force = contacts["force/y"][()]
        on_base = np.array([kind.get(b, 0) == 3 for b in second])
        from_base = np.array([kind[a] == 3 for a in first])
        lift = force[on_base].sum() - force[from_base].sum() + force[second == -3].sum()
        weight = file["packing"].attrs["mass"] * load(CASE)["geometry.gravity"]
    # a mean kinetic energy of 1e-5 m g d is a speed of 0.6 mm/s; were all of it the column's
    # breathing, at pi c/(2 H), about 2 kHz, it would be 0.1 g. Most of it is not.
    assert lift == pytest.approx(weight, rel=3e-2)


def test_every_contact_force_is_rebuilt_to_round_off(whole):
    """The largest force on a grain is some 1e-2 N; 1e-12 N is 1e-8 of a grain's weight."""
    with h5py.File(whole) as file:
        assert file.attrs["force_error"] < 1e-12


def test_the_balance_closes_to_a_thousandth_when_every_step_is_audited(audited):
    energy = energies(audited)
    assert np.abs(energy["unaccounted"]).max() < 1e-3 * released(energy)
    assert energy["dissipated"][-1] > 0.3 * released(energy)  # there was something to account for


def test_the_balance_is_not_closed_by_construction(audited):
    """Without the tangential part, a third of the released energy would be missing."""
    energy = energies(audited)
    missing = energy["unaccounted"] + energy["dissipated_tangential"]
    assert missing[-1] > 0.2 * released(energy)


def test_sampled_dissipation_closes_within_its_scatter(whole):
    """Some 5000 contact samples per energy row: a few per cent for so few grains.

    The seed's column has twenty times more.
    """
    energy = energies(whole)
    assert np.abs(energy["unaccounted"]).max() < 0.05 * released(energy)


def test_both_splits_of_the_dissipation_are_complete(whole, audited):
    for path in (whole, audited):
        energy = energies(path)
        pairs = energy["dissipated_normal"] + energy["dissipated_tangential"]
        assert energy["dissipated_short"] + energy["dissipated_enduring"] == pytest.approx(
            pairs, abs=1e-12 * released(energy)
        )
        assert energy["dissipated"] == pytest.approx(
            pairs + energy["dissipated_wall"], abs=1e-12 * released(energy)
        )
        assert energy["dissipated_base"][-1] < pairs[-1]
        with h5py.File(path) as file:
            classes = (
                file["lifetime/dissipated_normal"][()].sum()
                + file["lifetime/dissipated_tangential"][()].sum()
            )
        assert classes == pytest.approx(pairs[-1], rel=1e-9)


def dissipated_by_grains(path: Path) -> np.ndarray:
    """Sum over the moving grains, at every frame: of the record, and of the history then."""
    with h5py.File(path) as file:
        frames = [file[f"data/{step}"] for step in sorted(map(int, file["data"]))]
        sums = []
        for frame in frames:
            cloud = frame["particles/cloud"]
            assert not cloud["dissipated"][()][cloud["kind"][()] == 3].any()
            row = np.flatnonzero(file["energy/time"][()] == frame.attrs["time"]).item()
            sums.append((cloud["dissipated"][()].sum(), file["energy/dissipated"][row]))
    return np.array(sums).T


def test_what_each_grain_dissipates_adds_up_to_the_history(whole, audited):
    """Sampled, and as work less what contacts hold: thousands of sums of some ten contacts lose
    1e-12 of the total at most.
    """
    for path in (whole, audited):
        grains, history = dissipated_by_grains(path)
        assert len(grains) > 5 and grains[0] == history[0] == 0.0
        assert grains == pytest.approx(history, abs=1e-12 * history[-1])
        # half of the contacts with the base, which all count for the moving grain, would show
        assert energies(path)["dissipated_base"][-1] / 2 > 0.01 * history[-1]


def test_the_packing_is_what_was_asked_for(whole):
    case = load(CASE)
    with h5py.File(whole) as file:
        made = file["packing"]
        assert (
            abs(made.attrs["void_ratio"] - case["initial.void_ratio"])
            <= case["dem.void_ratio_tolerance"]
        )
        assert made["profile_mass"][()].sum() == pytest.approx(made.attrs["mass"], rel=1e-9)
        weight = made.attrs["mass"] * case["geometry.gravity"]
        width = case["geometry.length"] * case["geometry.thickness"]
        # vertical stress of the lowest cells, half a cell above the base, against the weight above
        # it
        lowest = made["profile_stress_yy"][()][:, 0].mean()
        half_cell = made["profile_mass"][()][:, 0].sum() / 2 / made.attrs["mass"]
        assert lowest == pytest.approx((1 - half_cell) * weight / width, rel=0.1)


def test_a_seed_gives_the_same_bits_again(whole, tmp_path):
    """From pouring on, in a store of its own."""
    assert (
        main([CASE, "-o", str(tmp_path / "dem.h5"), "--packings", str(tmp_path / "new"), "--quiet"])
        == 0
    )
    with h5py.File(tmp_path / "dem.h5", "a") as file:
        del file["packing/attempts"]
    with h5py.File(whole, "a") as file:
        file.move("packing/attempts", "attempts")
    assert digest(tmp_path / "dem.h5") == digest(whole)
    with h5py.File(whole, "a") as file:
        file.move("attempts", "packing/attempts")


def test_two_ranks_make_the_same_collapse(tmp_path, store):
    """The floor is cut so short that grains pass from one rank's half of the box to the other's.

    Sums run in another order there, and a collision multiplies a difference of round-off about
    tenfold: some ten collisions later trajectories differ visibly, energies still by far less than
    from seed to seed (some per cent).
    """
    energy = {}
    for ranks in (1, 2):
        path = tmp_path / f"{ranks}.h5"
        words = [
            "--driver",
            "script",
            "--ranks",
            str(ranks),
            "--set",
            "geometry.floor_length=0.044",
            "--set",
            "time.maximum=2",
            "--quiet",
        ]
        assert main([CASE, "-o", str(path), "--packings", str(store), *words]) == 0
        energy[ranks] = energies(path)
        with h5py.File(path) as file:
            assert file.attrs["threads"] == ranks
            frame = file[f"data/{file.attrs['steps']}/particles/cloud"]
            assert (frame["position/x"][()][frame["kind"][()] == 1] > 0.022).sum() > 20
    for name in ("kinetic", "potential"):
        difference = np.abs(energy[2][name] - energy[1][name]).max() / released(energy[1])
        assert 0 < difference < 0.01


def test_the_script_runs_the_same_trajectory_bit_for_bit(tmp_path, store, whole):
    paths = {driver: tmp_path / f"{driver}.h5" for driver in ("library", "script")}
    for driver, path in paths.items():
        assert (
            main([CASE, "-o", str(path), "--packings", str(store), "--driver", driver, *SHORT]) == 0
        )
    with h5py.File(paths["library"]) as ours, h5py.File(paths["script"]) as theirs:
        assert list(ours["data"]) == list(theirs["data"])
        for step in ours["data"]:
            for record in ("position", "velocity", "angular_velocity"):
                for axis in "xyz":
                    name = f"data/{step}/particles/cloud/{record}/{axis}"
                    assert np.array_equal(ours[name][()], theirs[name][()]), name
        for name in ("kinetic", "potential", "rotational"):
            assert ours[f"energy/{name}"][()] == pytest.approx(
                theirs[f"energy/{name}"][()], rel=1e-12, abs=1e-20
            )


def test_without_samples_dissipation_comes_as_a_total(tmp_path, store, whole):
    path = tmp_path / "dem.h5"
    assert (
        main(
            [
                CASE,
                "-o",
                str(path),
                "--packings",
                str(store),
                "--set",
                "dem.audit_interval=0",
                *SHORT,
            ]
        )
        == 0
    )
    energy = energies(path)
    assert "dissipated_normal" not in energy and np.isnan(energy["unaccounted"]).all()
    with h5py.File(path) as file:
        assert not any("dissipated" in file[f"data/{k}/particles/cloud"] for k in file["data"])
    held = sum(energy[name] for name in ("kinetic", "rotational", "potential", "elastic"))
    assert energy["dissipated"] == pytest.approx(held[0] - held, abs=1e-12 * held[0])


def test_progress_rises_to_one(capfd, tmp_path, store, whole):
    words = [
        CASE,
        "-o",
        str(tmp_path / "dem.h5"),
        "--packings",
        str(store),
        "--progress",
        "--set",
        "time.maximum=0.3",
    ]
    assert main(words) == 0
    lines = capfd.readouterr().out.splitlines()
    done = [float(line.split()[1]) for line in lines]
    assert all(line.startswith("progress ") for line in lines)
    assert done == sorted(done) and done[-1] == 1.0


def by_script_with(path, tmp_path, store, monkeypatch, capfd):
    monkeypatch.setenv("PATH", str(path))
    code = main(
        [
            CASE,
            "-o",
            str(tmp_path / "dem.h5"),
            "--packings",
            str(store),
            "--driver",
            "script",
            *SHORT,
        ]
    )
    left = [found.name for found in tmp_path.iterdir() if found != path]
    return code, capfd.readouterr().err.splitlines(), left


def test_no_engine_on_the_path_ends_with_code_3(tmp_path, store, whole, monkeypatch, capfd):
    code, said, left = by_script_with(tmp_path / "bin", tmp_path, store, monkeypatch, capfd)
    assert (code, len(said), left) == (3, 1, [])
    assert "not installed" in said[0]


def test_a_crashing_engine_ends_with_code_3_and_its_own_words(
    tmp_path, store, whole, monkeypatch, capfd
):
    folder = tmp_path / "bin"
    folder.mkdir()
    (folder / "liggghts").write_text(
        "#!/bin/sh\necho 'ERROR on proc 0: Box bounds are invalid'\nexit 1\n"
    )
    (folder / "liggghts").chmod(0o755)
    (folder / "stdbuf").symlink_to(shutil.which("stdbuf"))
    code, said, left = by_script_with(folder, tmp_path, store, monkeypatch, capfd)
    assert (code, len(said), left) == (3, 1, [])
    assert "Box bounds are invalid" in said[0]


def test_the_search_moves_towards_the_void_ratio_asked_for():
    friction, damping = packing.next_try(1.0, 1.0, 0.70, 0.71)
    assert friction > 1.0 and damping == 1.0
    assert packing.next_try(1.0, 1.0, 0.72, 0.71)[0] < 1.0
    assert packing.next_try(2.0, 1.0, 0.70, 0.71) == (2.0, 1.5)


def test_different_seeds_make_different_packings():
    case = packing.dict_of(load(CASE))
    assert content.packing_key(case, 1) != content.packing_key(case, 2)
    case["dem"]["audit_interval"] = 7
    assert content.packing_key(case, 1) == content.packing_key(packing.dict_of(load(CASE)), 1)


def test_progress_never_falls(capsys):
    progress = Progress(True)
    progress.part(0, 0.5)(1.0, "first")
    progress.part(0, 0.5)(0.1, "late")
    progress.part(0, 1)(1.0, "done")
    done = [float(line.split()[1]) for line in capsys.readouterr().out.splitlines()]
    assert done == sorted(done)
