"""The comparison of a synthetic pair, whose every number is known, from HDF5 files to the report.
"""

import json
import re

import h5py
import pandas as pd
import pytest
from browser import browser  # noqa: F401
from synthetic import write_pair, write_run

from compare import __main__ as cli
from compare.mapping.runs import map_fields
from compare.verdict import comparison, conclusion, controls
from compare.report import report
from cases.errors import CaseError


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A pair whose grains spread 1.05 times as far, weigh 1.7/1.72 as much and dissipate the same
    share.
    """
    folder = write_pair(
        tmp_path_factory.mktemp("pair"),
        mpm={"frames": 11},
        dem={"frames": 11, "stretch": 2.1, "void_ratio": 0.72},
    )
    words = ["--width-study", "--quiet", "--table", str(folder.parent / "kept" / "verdicts.csv")]
    assert cli.main(["compare", str(folder), *words]) == 0
    return folder


@pytest.fixture(scope="module")
def metrics(folder):
    return json.loads((folder / "metrics.json").read_text())


def test_the_folder_holds_what_it_should(folder):
    assert {p.name for p in folder.iterdir()} == {
        "mpm.h5",
        "dem.h5",
        "fields.h5",
        "metrics.json",
        "report.html",
        "figures",
    }
    names = {p.stem for p in (folder / "figures").iterdir()}
    for name in names:
        assert (folder / "figures" / f"{name}.svg").stat().st_size > 0
        assert (folder / "figures" / f"{name}.png").stat().st_size > 0
    assert {
        "surface_profiles",
        "map_void_ratio",
        "map_granular_temperature",
        "map_speed",
        "energies",
        "energy_budget",
        "width_study",
    } <= names


def test_the_kept_table_is_what_the_metrics_say(folder, metrics):
    path = folder.parent / "kept" / "verdicts.csv"
    table = pd.read_csv(path, comment="#").set_index("metric")
    assert set(table.index) == {name for name, entry in metrics.items() if "verdict" in entry}
    for name, row in table.iterrows():
        entry = metrics[name]
        assert (
            row["verdict"] == entry["verdict"]
            and row["shuffled"] == metrics["control_shuffled"]["words"][name]
        )
        assert row["difference"] == pytest.approx(
            entry.get("difference", entry.get("value")), rel=1e-3
        )
    assert "control_shuffled " + metrics["control_shuffled"]["value"] in path.read_text()


def test_masses_are_equal_after_pairing(metrics):
    assert metrics["mass"]["mpm"] == pytest.approx(metrics["mass"]["dem"], rel=1e-12)
    assert metrics["mass_scale"]["value"] == pytest.approx(1.70 / 1.72, rel=1e-12)


def test_mapped_mass_is_the_mass(metrics):
    for engine in ("mpm", "dem"):
        assert metrics["mapped_mass"][engine] == pytest.approx(metrics["mass"][engine], rel=1e-12)


def test_mapped_fields_conserve_in_every_frame(folder):
    with h5py.File(folder / "fields.h5") as f:
        cell = f["grid"].attrs["cell_volume"]
        for engine in ("mpm", "dem"):
            with h5py.File(folder / f"{engine}.h5") as run:
                steps = sorted(run["data"], key=int)
                for i, step in enumerate(steps):
                    cloud = run[f"data/{step}/particles/cloud"]
                    mass = cloud["mass"][:]
                    assert f[engine]["density"][i].sum() * cell == pytest.approx(
                        mass.sum(), rel=1e-12
                    )
                    for k, component in enumerate("xyz"):
                        momentum = (mass * cloud[f"velocity/{component}"][:]).sum()
                        scale = (mass * abs(cloud[f"velocity/{component}"][:])).sum()
                        assert f[engine]["momentum"][i][..., k].sum() * cell == pytest.approx(
                            momentum, abs=1e-12 * scale
                        )


def test_run_out_is_the_stretch(metrics):
    # x_99.5 of a uniform block of length s L0 is 0.995 s L0; the lattice resolves it to one
    # spacing, stretched.
    assert metrics["run_out"]["mpm"] == pytest.approx(0.995 * 2.0 - 1.0, abs=2.0 * 0.00125 / 0.04)
    assert metrics["run_out"]["dem"] == pytest.approx(0.995 * 2.1 - 1.0, abs=2.1 * 0.002 / 0.04)


def test_final_height_is_the_stretch(metrics):
    # The block's height is H/s; its sharp edge, smoothed, is found to a fraction of a cell of d =
    # 0.05 H.
    assert metrics["final_height"]["mpm"] == pytest.approx(1.0 / 2.0, abs=0.02)
    assert metrics["final_height"]["dem"] == pytest.approx(1.0 / 2.1, abs=0.03)


def test_energy_peak(metrics):
    assert metrics["kinetic_energy_peak_time"]["mpm"] == pytest.approx(1.2, abs=1e-6)
    # 0.05 M g H over the energy released, M g H/2 (1 - 1/2.1)
    assert metrics["kinetic_energy_peak"]["dem"] == pytest.approx(
        0.05 / (0.5 * (1.0 - 1.0 / 2.1)), rel=2e-3
    )


def test_energy_released_is_dissipated_or_unaccounted(metrics):
    released = metrics["released_energy"]
    assert metrics["dissipated_energy"]["dem"] + metrics["unaccounted_energy"][
        "dem"
    ] == pytest.approx(1.0, abs=1e-6)
    share = metrics["dissipated_energy"]["mpm"] + metrics["unaccounted_energy"]["mpm"]
    assert share == pytest.approx(released["mpm"] / released["dem"], rel=1e-6)


def test_every_metric_is_documented(metrics):
    for name, entry in metrics.items():
        assert entry["unit"] and entry["definition"] and entry["source"], name
        assert "value" in entry or {"mpm", "dem", "difference"} <= set(entry), name


def test_report_is_one_self_contained_page(folder):
    page = (folder / "report.html").read_text()
    assert not re.findall(r'(?:src|href|srcset)="(?!data:|#)', page)
    assert "http://" not in re.sub(r"data:[^\"]*", "", page) and "https://" not in re.sub(
        r"data:[^\"]*", "", page
    )
    assert (
        page.index("verdict")
        < page.index("<figure>")
        < page.index('id="metrics"')
        < page.index('id="provenance"')
    )
    assert page.count("<figcaption>") == page.count("<figure>") >= 7
    assert all(
        len(sentence) > 40 for sentence in re.findall(r"<figcaption>(.*?)</figcaption>", page, re.S)
    )


@pytest.mark.parametrize("options", [{"width": 1280}, {"width": 390, "dark": True}], ids=str)
def test_the_report_opens_and_plays(folder, browser, options):  # noqa: F811
    page = browser.open(folder / "report.html", **options)
    page.wait("document.querySelector('.player').dataset.ready")
    page.evaluate("document.querySelector('.player-play').click()")
    page.wait("document.querySelector('.player').player.drawing.drawn > 5")
    assert page.errors == [] and page.requests == []
    player = "document.querySelector('.player')"
    assert page.evaluate(f"{player}.scrollWidth <= {player}.clientWidth")


def test_comparing_again_changes_no_number(folder, metrics):
    c = comparison.load(folder)
    again = conclusion.conclude(c, controls.judge_all(c, folder))
    assert json.loads(json.dumps(again)) == metrics


def test_shuffled_instants_are_rejected(metrics):
    assert metrics["control_shuffled"]["value"] == "rejected"


def test_a_control_that_equals_the_grains_is_not_rejected(folder):
    # The control machinery must be able to say "passes", or its rejections mean nothing.
    c = comparison.load(folder)
    assert not controls.judge("shuffled", c.dem[0], c).rejected


def test_an_ensemble_gives_a_verdict(tmp_path):
    folder = write_pair(tmp_path, mpm={"frames": 3}, dem={"frames": 3})
    for seed in range(3, 6):
        write_run(folder / f"dem_{seed}.h5", "dem", seed=seed, frames=3, stretch=2.0 + 0.002 * seed)
    map_fields(sorted(folder.glob("*.h5")), folder / "fields.h5")
    metrics = comparison.evaluate(comparison.load(folder))
    assert metrics["run_out"]["verdict"] == "agree"
    assert len(metrics["run_out"]["dem_runs"]) == 4
    assert metrics["wasserstein_x"]["noise_floor"] > 0.0


def test_an_engine_that_goes_another_way_differs(tmp_path):
    folder = write_pair(tmp_path, mpm={"frames": 3, "stretch": 1.5}, dem={"frames": 3})
    write_run(folder / "dem_3.h5", "dem", seed=3, frames=3, stretch=2.01)
    write_run(folder / "dem_4.h5", "dem", seed=4, frames=3, stretch=1.99)
    map_fields(sorted(folder.glob("*.h5")), folder / "fields.h5")
    metrics = comparison.evaluate(comparison.load(folder))
    assert metrics["verdict"]["value"] == "differ"
    assert metrics["run_out"]["verdict"] == metrics["wasserstein_x"]["verdict"] == "differ"


def test_runs_of_two_scenes_are_refused(tmp_path):
    folder = write_pair(tmp_path, mpm={"frames": 2}, dem={"frames": 2, "height": 0.05})
    map_fields(sorted(folder.glob("*.h5")), folder / "fields.h5")
    with pytest.raises(CaseError, match="geometry.height"):
        comparison.load(folder)


def test_a_folder_without_runs_is_refused(tmp_path):
    with pytest.raises(CaseError, match="no mpm.h5"):
        report.compare(tmp_path)


def test_a_broken_file_is_refused_and_leaves_nothing(tmp_path):
    folder = write_pair(tmp_path, mpm={"frames": 2}, dem={"frames": 2})
    (folder / "dem.h5").write_bytes(b"not HDF5")
    with pytest.raises(CaseError, match="dem.h5"):
        report.compare(folder)
    assert {p.name for p in folder.iterdir()} == {"mpm.h5", "dem.h5"}


def test_a_point_that_escaped_is_refused(tmp_path):
    folder = write_pair(tmp_path, mpm={"frames": 2}, dem={"frames": 2})
    with h5py.File(folder / "mpm.h5", "a") as f:
        f["data/100/particles/cloud/position/x"][0] = 1e9
    with pytest.raises(CaseError, match="a point has escaped"):
        map_fields([folder / "mpm.h5"], folder / "fields.h5")
    assert not (folder / "fields.h5").exists()
