"""Laws of shared libraries: how they are called, and what is said of those that fail."""

import csv
import shutil
import subprocess

import hostile
import pytest

from cases.errors import Failure, code_of
from cases.programs import ROOT, module, program

CASE = ROOT / "cases" / "column_ci"
ELASTIC = {"constants": "[1e6, 5e5]"}
PATH = """
case = "{case}"
every = 1
[start]
pressure = 1000.0
[[leg]]
path = "{path}"
{leg}
steps = {steps}
"""


def call(*words) -> subprocess.CompletedProcess:
    return subprocess.run(
        [str(word) for word in words], capture_output=True, text=True, check=False
    )


def refused(done, code=2) -> str:
    """The one line of a refusal."""
    assert done.returncode == code, done.stderr
    lines = done.stderr.strip().splitlines()
    assert len(lines) == 1, done.stderr
    return lines[0]


def drive(folder, keys, path="strain", leg="rate = [0, 1, 0, 0, 0, 0]\nduration = 1e-3", steps=10):
    """The rows of a point driven along one leg, or the run that failed."""
    file, out = folder / "path.toml", folder / "out.csv"
    file.write_text(PATH.format(case=CASE / "case.toml", path=path, leg=leg, steps=steps))
    out.unlink(missing_ok=True)
    done = call(program("mpm_point"), file, "-o", out, *keys)
    if done.returncode:
        assert not out.exists()
        return done
    with out.open() as lines:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(lines)]


BAD_KEYS: list[tuple[dict, str]] = [
    ({"library": "nowhere.so"}, "no library 'nowhere.so'"),
    ({"symbol": "my_law"}, "no function 'my_law'"),
    ({"interface": "esm"}, "no function 'esm_' or 'esm' or 'ESM'"),
    ({"constants": "[1e6, 5e5]", "parameters_file": "constants.txt"}, "one of them, not both"),
    ({"initial_state": "[1.0]"}, "initial_state holds 1 numbers"),
    ({"state_variables": 2, "void_ratio_state": 3}, "there are 2 state variables"),
    ({"library_digest": "0123456789abcdef"}, "another library than the case means"),
]


@pytest.mark.parametrize("changed, said", BAD_KEYS, ids=[next(iter(k[0])) for k in BAD_KEYS])
def test_bad_keys_give_one_line(tmp_path, changed, said):
    told = {"library": hostile.umat(tmp_path, ""), "interface": "umat"} | ELASTIC | changed
    out = tmp_path / "mpm.h5"
    line = refused(call(program("mpm_run"), CASE, "-o", out, *hostile.keys(**told)))
    assert said in line
    assert not out.exists()


def test_what_is_no_library_is_told(tmp_path):
    text = tmp_path / "text.so"
    text.write_text("no library at all, but long enough to hold a header of one " * 4)
    other = bytearray(hostile.umat(tmp_path, "").read_bytes())
    other[4] = 1  # a class of 32 bits
    foreign = tmp_path / "foreign.so"
    foreign.write_bytes(other)
    for library, said in [(text, "no shared library"), (foreign, "another machine")]:
        keys = hostile.keys(library, **ELASTIC)
        assert said in refused(call(program("mpm_run"), CASE, "-o", tmp_path / "x.h5", *keys))
    unresolved = hostile.compiled(tmp_path, "void umat_(){ extern void gone(void); gone(); }", "u")
    line = refused(
        call(program("mpm_run"), CASE, "-o", tmp_path / "x.h5", *hostile.keys(unresolved))
    )
    assert "undefined symbol: gone" in line and "link what it calls" in line


def test_a_law_without_interface_or_library_is_refused(tmp_path):
    for keys, said in [
        (["--set", "material.law=external"], "without material.library"),
        (
            ["--set", "material.law=external", "--set", "material.library=x.so"],
            "without material.i",
        ),
    ]:
        assert said in refused(call(program("mpm_run"), CASE, "-o", tmp_path / "x.h5", *keys))


def test_constants_of_a_file(tmp_path):
    library = hostile.umat(tmp_path, "")
    file = tmp_path / "constants.txt"
    file.write_text("** stiffness\n1.0d6, 5e5  # K and G\n")
    told = drive(tmp_path, hostile.keys(library, parameters_file=file))
    assert told == drive(tmp_path, hostile.keys(library, **ELASTIC))
    file.write_text("1e6\nsoft\n")
    line = refused(drive(tmp_path, hostile.keys(library, parameters_file=file)))
    assert line.startswith(f"{file}:2: 'soft' is no number")


def test_a_umat_is_called_as_documented(tmp_path):
    """It writes down what it is told: the first step of a simple shear by .02 in 10 steps."""
    told = """
    statev[0] = dstran[3]; statev[1] = drot[1]; statev[2] = time[1]; statev[3] = *dtime;
    statev[4] = *noel; statev[5] = *kinc; statev[6] = stran[3]; statev[7] = *ntens;
    statev[8] = dfgrd1[3]; statev[9] = props[1]; statev[10] += 1;
    if (*kinc == 3) {
      for (int i = 0; i < 10; ++i) printf("%.17g ", statev[i]);
      fflush(stdout);
      exit(0);
    }
    """
    source = "#include <stdio.h>\n" + hostile.UMAT % told
    library = hostile.compiled(tmp_path, source)
    keys = hostile.keys(library, state_variables=11, **ELASTIC)
    done = drive(tmp_path, keys, "simple_shear", 'constant = "volume"\nrate = 1.0\nstrain = 0.02')
    assert code_of(done.stderr.strip().splitlines()[-1]) == Failure.LIBRARY
    shear, turn, time, dt, noel, kinc, total, ntens, gradient, shear_modulus = map(
        float, done.stdout.split()
    )
    step = 0.02 / 10
    # dv_x/dy = -rate: an engineering shear strain of as much, and half of it counter-clockwise
    assert shear == pytest.approx(-step)
    assert turn == pytest.approx(0.5 * step, rel=1e-5)  # DROT(2,1)
    assert gradient == pytest.approx(-step)  # DFGRD1(1,2)
    assert (time, dt) == (pytest.approx(2 * step), pytest.approx(step))
    assert (kinc, ntens, shear_modulus) == (3, 6, 5e5)
    assert total == pytest.approx(-2 * step, rel=1e-3)
    assert noel >= 1


def test_a_law_asks_for_smaller_steps(tmp_path):
    """PNEWDT: the state counts the calls that were accepted."""
    counting = """
    statev[0] += 1;
    if (fabs(dstran[1]) > 3e-5) { *pnewdt = 0.25; statev[0] += 100; stress[0] = 1e9; }
    """
    library = hostile.umat(tmp_path, counting)
    whole = drive(tmp_path, hostile.keys(hostile.umat(tmp_path, "", "plain"), **ELASTIC))
    keys = hostile.keys(library, state_variables=1, **ELASTIC)
    parts = drive(tmp_path, keys)
    for key in ("sigma_q_xx", "sigma_q_yy", "void_ratio"):
        assert parts[-1][key] == pytest.approx(whole[-1][key], rel=1e-12)
    never = hostile.umat(tmp_path, "*pnewdt = 0.5;", "never")
    line = drive(tmp_path, hostile.keys(never, **ELASTIC)).stderr.strip()
    assert "ever smaller steps (PNEWDT)" in line and code_of(line) == Failure.LIBRARY


ENDS = {
    "not a number": ("stress[0] = sqrt(-1.0);", "its answer is no number"),
    "beside": ("stress[6] = 1.0;", "writes beside its arrays"),
    "before": ("props[-1] = 1.0;", "writes beside its arrays"),
}


@pytest.mark.parametrize("also, said", ENDS.values(), ids=ENDS)
def test_a_law_that_fails_is_named_with_point_and_step(tmp_path, also, said):
    library = hostile.umat(tmp_path, "if (*kinc == 3) {" + also + "}")
    out = tmp_path / "mpm.h5"
    out.write_text("an earlier result")
    keys = hostile.keys(library, **ELASTIC)
    done = call(program("mpm_run"), CASE, "-o", out, *keys)
    line = refused(done, 3)
    assert said in line and "point " in line and "step 3" in line
    assert code_of(line) == Failure.LIBRARY
    assert out.read_text() == "an earlier result"
    assert list(tmp_path.glob("*mpm.h5*")) == [out]


def test_a_law_without_stiffness_is_named_at_once(tmp_path):
    library = hostile.umat(tmp_path, "for (int i = 0; i < 36; ++i) ddsdde[i] = 0;")
    line = refused(drive(tmp_path, hostile.keys(library, **ELASTIC)), 3)
    assert "tells no stiffness" in line and code_of(line) == Failure.LIBRARY


SIGNALS = {
    "exit": ("exit(0);", 3, "it called exit, or STOP"),
    "abort": ("abort();", -6, "Aborted"),
    "segmentation": ("*(volatile int*)8 = 1;", -11, "Segmentation fault"),
}


@pytest.mark.parametrize("also, code, said", SIGNALS.values(), ids=SIGNALS)
def test_a_law_that_ends_the_program_is_named(tmp_path, also, code, said):
    library = hostile.umat(tmp_path, "if (*kinc == 3) {" + also + "}")
    out = tmp_path / "mpm.h5"
    out.write_text("an earlier result")
    keys = hostile.keys(library, **ELASTIC)
    line = refused(call(program("mpm_run"), CASE, "-o", out, *keys), code)
    assert said in line and code_of(line) == Failure.LIBRARY
    assert out.read_text() == "an earlier result"
    options = ["--interface", "umat", "--constants", "1e6,5e5"]
    asked = call(*module("compare", "law-test", library, *options))
    assert asked.returncode == 3
    assert "while it was asked for 'rest'" in asked.stderr.strip()


def test_a_law_that_never_answers_is_left(tmp_path):
    library = hostile.umat(tmp_path, "if (*kinc == 3) for (;;) *pnewdt = 1.0;")
    options = ["--interface", "umat", "--constants", "1e6,5e5", "--timeout", "1"]
    line = refused(call(*module("compare", "law-test", library, *options)), 3)
    assert "no answer within 1 s while it was asked for 'rest'" in line


def test_a_law_that_throws_is_caught(tmp_path):
    source = """
    #include <stdexcept>
    #include "mpm/external_law.h"
    int grainpair_law(grainpair_block* block) {
      for (int i = 0; i < block->size; ++i) block->modulus[i] = 1e6;
      if (block->strain[1][0] > 5e-5) throw std::runtime_error("too far");
      return 0;
    }
    """
    library = hostile.compiled(tmp_path, source, language="c++")
    line = refused(drive(tmp_path, hostile.keys(library, "grainpair")), 3)
    assert "the law throws: too far" in line


def test_a_block_law_of_another_version_is_refused(tmp_path):
    source = """
    #include "mpm/external_law.h"
    int grainpair_law_version(void) { return GRAINPAIR_LAW_VERSION + 1; }
    int grainpair_law(grainpair_block* block) { return 1; }
    """
    line = refused(drive(tmp_path, hostile.keys(hostile.compiled(tmp_path, source), "grainpair")))
    assert "compiled for version 2" in line


def test_a_block_law_names_the_point_it_cannot_update(tmp_path):
    source = """
    #include "mpm/external_law.h"
    int grainpair_law(grainpair_block* block) {
      for (int i = 0; i < block->size; ++i) block->modulus[i] = 1e6;
      return block->strain[1][0] > 0 ? 1 : 0;
    }
    """
    keys = hostile.keys(hostile.compiled(tmp_path, source), "grainpair")
    assert "the law cannot update it" in refused(drive(tmp_path, keys), 3)


SHARED = "static double before; stress[0] += 1e-3 * before; before = dstran[0] * props[0];"


def law_test(library, *options):
    words = ["--interface", "umat", "--constants", "1e6,5e5", *options]
    done = call(*module("compare", "law-test", library, *words))
    rows = {line[7:20].strip(): line[:5] for line in done.stdout.splitlines()[:-1]}
    return done, rows


def test_law_test_finds_what_points_share(tmp_path):
    good, rows = law_test(hostile.umat(tmp_path, ""))
    assert good.returncode == 0 and set(rows.values()) == {"holds"}
    shared, rows = law_test(hostile.umat(tmp_path, SHARED, "shared"))
    assert shared.returncode == 1 and rows["apart"] == "fails"


WRONG = {
    "rest": "stress[0] -= 1.0;",
    "objectivity": "stress[0] *= 1.001;",
    "modulus": "ddsdde[0] = ddsdde[7] = ddsdde[14] = 0.5 * K;",
    "tangent": "ddsdde[21] *= 2.0;",
    "large steps": "if (fabs(volume) > 0.05) stress[0] = sqrt(-1.0);",
    "loops": "stress[1] += 0.5 * K * (volume > 0 ? volume : -volume);",
}


@pytest.mark.parametrize("name", WRONG)
def test_law_test_finds_what_is_wrong(tmp_path, name):
    done, rows = law_test(hostile.umat(tmp_path, WRONG[name]))
    assert done.returncode == 1
    assert rows[name] == "fails", done.stdout


FIXED_FORM = """
      SUBROUTINE UMAT(STRESS,STATEV,DDSDDE,SSE,SPD,SCD,
     1 RPL,DDSDDT,DRPLDE,DRPLDT,
     2 STRAN,DSTRAN,TIME,DTIME,TEMP,DTEMP,PREDEF,DPRED,CMNAME,
     3 NDI,NSHR,NTENS,NSTATV,PROPS,NPROPS,COORDS,DROT,PNEWDT,
     4 CELENT,DFGRD0,DFGRD1,NOEL,NPT,LAYER,KSPT,JSTEP,KINC)
      INCLUDE 'ABA_PARAM.INC'
      CHARACTER*80 CMNAME
      DIMENSION STRESS(NTENS),DDSDDE(NTENS,NTENS),DSTRAN(NTENS),PROPS(2)
      DDSDDE=0.D0
      DO K=1,3
        DDSDDE(1:3,K)=PROPS(1)-2.D0/3.D0*PROPS(2)
        DDSDDE(K+3,K+3)=PROPS(2)
      END DO
      DO K=1,3
        DDSDDE(K,K)=DDSDDE(K,K)+2.D0*PROPS(2)
      END DO
      STRESS=STRESS+MATMUL(DDSDDE,DSTRAN)
      END
"""


@pytest.mark.skipif(shutil.which("gfortran") is None, reason="needs gfortran")
def test_a_umat_as_people_have_it(tmp_path):
    """Fixed form, with the file that Abaqus' own include; the same as the one in C."""
    source, library = tmp_path / "mine.f", tmp_path / "libmine.so"
    source.write_text(FIXED_FORM)
    where = f"-I{ROOT / 'cases' / 'laws'}"
    compiled = call("gfortran", "-O1", "-shared", "-fPIC", where, source, "-o", library)
    assert compiled.returncode == 0, compiled.stderr
    in_c = drive(tmp_path, hostile.keys(hostile.umat(tmp_path, ""), **ELASTIC))
    rows = drive(tmp_path, hostile.keys(library, **ELASTIC))
    for name in ("sigma_q_xx", "sigma_q_yy"):
        assert rows[-1][name] == pytest.approx(in_c[-1][name], rel=1e-12)


def test_law_test_takes_a_case(tmp_path):
    done = call(*module("compare", "law-test", CASE, "--set", "material.law=lade_duncan"))
    assert done.returncode == 0 and "10 of 10 hold" in done.stdout
    done = call(*module("compare", "law-test", CASE, "--interface", "umat"))
    assert "of a library" in refused(done)
    assert "no such file" in refused(call(*module("compare", "law-test", "gone.so")))


def test_a_library_is_found_where_the_command_is_typed(tmp_path):
    hostile.umat(tmp_path, "")
    words = [program("mpm_case"), CASE, *hostile.keys("liblaw.so", **ELASTIC)]
    typed = [str(word) for word in words]
    done = subprocess.run(typed, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert f'library = "{tmp_path / "liblaw.so"}"' in done.stdout
    assert "no library 'liblaw.so'" in refused(call(*words))


def test_a_case_finds_its_library_beside_it_and_keeps_its_digest(tmp_path):
    library = hostile.umat(tmp_path, "")
    scene = tmp_path / "scene"
    scene.mkdir()
    shutil.move(library, scene / "libmine.so")
    (scene / "case.toml").write_text(
        f'extends = "{CASE / "case.toml"}"\n[material]\nlaw = "external"\n'
        'library = "libmine.so"\ninterface = "umat"\nconstants = [1e6, 5e5]\n'
    )
    shown = call(program("mpm_case"), scene)
    assert shown.returncode == 0
    resolved = tmp_path / "resolved.toml"
    resolved.write_text(shown.stdout)
    assert call(program("mpm_case"), resolved).stdout == shown.stdout
    hostile.umat(scene, "stress[0] += 0.0;", "mine")
    assert "another library" in refused(call(program("mpm_case"), resolved))
