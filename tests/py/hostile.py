"""Laws that do what they should not, or tell how they were called; compiled on the spot."""

import shutil
import subprocess
from functools import cache
from pathlib import Path

import pytest

from cases.programs import ROOT

UMAT = """
#include <stdlib.h>
#include <math.h>
#include <signal.h>
void umat_(double* stress, double* statev, double* ddsdde, double* sse, double* spd, double* scd,
           double* rpl, double* ddsddt, double* drplde, double* drpldt, double* stran,
           double* dstran, double* time, double* dtime, double* temp, double* dtemp,
           double* predef, double* dpred, char* cmname, int* ndi, int* nshr, int* ntens,
           int* nstatv, double* props, int* nprops, double* coords, double* drot, double* pnewdt,
           double* celent, double* dfgrd0, double* dfgrd1, int* noel, int* npt, int* layer,
           int* kspt, int* kstep, int* kinc, size_t length) {
  const double K = props[0], G = props[1];
  const double volume = dstran[0] + dstran[1] + dstran[2];
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) ddsdde[6 * i + j] = i < 3 && j < 3 ? K - 2.0 / 3.0 * G : 0.0;
    ddsdde[7 * i] += i < 3 ? 2.0 * G : G;
    stress[i] += (i < 3 ? 2.0 * G : G) * dstran[i] + (i < 3 ? (K - 2.0 / 3.0 * G) * volume : 0.0);
  }
  %s
}
"""


@cache
def compiler() -> str:
    """Skips where there is none."""
    found = shutil.which("gcc")
    if found is None:
        pytest.skip("needs gcc")
    return found


def compiled(folder: Path, source: str, name: str = "law", language: str = "c") -> Path:
    """The shared library of a source text."""
    library = folder / f"lib{name}.so"
    words = [compiler(), "-x", language, "-O1", "-shared", "-fPIC", f"-I{ROOT}", "-o", str(library)]
    subprocess.run(
        [*words, "-", "-lm", *(["-lstdc++"] if language == "c++" else [])],
        input=source.encode(),
        check=True,
    )
    return library


def umat(folder: Path, also: str, name: str = "law") -> Path:
    """Linear elasticity of constants K and G that besides does what `also` says."""
    return compiled(folder, UMAT % also, name)


def keys(library: Path | str, interface: str = "umat", **more) -> list[str]:
    """What a case says of it, as words of a command line."""
    told = {"law": "external", "library": library, "interface": interface} | more
    given = [f"material.{key}={value}" for key, value in told.items()]
    return [word for one in given for word in ("--set", one)]
