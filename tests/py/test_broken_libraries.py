"""Files that are no whole shared library, and libraries that cannot even be loaded: one line."""

import struct

import hostile
import pytest

from cases.programs import ROOT, call, program

CASE = ROOT / "cases" / "column_ci"
ELASTIC = {"constants": "[1e6, 5e5]"}
DYNAMIC, LOAD = 2, 1  # kinds of segments [System V Application Binary Interface]


def segments(data: bytes, kind: int) -> list[int]:
    """Where the entries of that kind begin in the table of segments of a library of 64 bits."""
    (table,), (count,) = struct.unpack_from("<Q", data, 32), struct.unpack_from("<H", data, 56)
    places = [table + 56 * i for i in range(count)]
    return [at for at in places if struct.unpack_from("<I", data, at)[0] == kind]


def told(tmp_path, library) -> str:
    """The line of mpm_run that refuses a library."""
    done = estimated(tmp_path, library)
    assert done.returncode == 2 and not done.stdout, (done.returncode, done.stderr)
    assert done.stderr.count("\n") == 1
    return done.stderr


def estimated(tmp_path, library):
    """The end of what loads a library, and takes one step."""
    words = [program("mpm_run"), CASE, "-o", tmp_path / "x.h5", "--estimate"]
    return call([*words, *hostile.keys(library, **ELASTIC)])


@pytest.mark.parametrize("share", [0.02, 0.1, 0.3, 0.6])
def test_a_library_that_is_cut_short(tmp_path, share):
    data = hostile.umat(tmp_path, "").read_bytes()
    cut = tmp_path / "cut.so"
    cut.write_bytes(data[: int(share * len(data))])
    assert "cannot be loaded (" in told(tmp_path, cut)


@pytest.mark.parametrize(
    "kind, field, value, said",
    [
        (LOAD, 8, 1 << 50, "beyond its end"),  # where it begins in the file
        (LOAD, 32, (1 << 64) - 1, "beyond its end"),  # how long it is there
        (LOAD, 40, 0, "segment is broken"),  # and in memory: less
        (DYNAMIC, 16, 1 << 40, "dynamic section is broken"),  # its address
        (DYNAMIC, 32, 16, "dynamic section is broken"),  # its length: without an end
    ],
)
def test_segments_beyond_the_file(tmp_path, kind, field, value, said):
    data = bytearray(hostile.umat(tmp_path, "").read_bytes())
    struct.pack_into("<Q", data, segments(data, kind)[0] + field, value)
    broken = tmp_path / "broken.so"
    broken.write_bytes(data)
    assert said in told(tmp_path, broken)


def test_zeros_in_place_of_the_tables(tmp_path):
    """As a disk that was full leaves them: the size is right, the rest is empty."""
    data = hostile.umat(tmp_path, "").read_bytes()
    for share in (0.01, 0.2, 0.5):
        keep = int(share * len(data))
        holed = tmp_path / "holed.so"
        holed.write_bytes(data[:keep] + bytes(len(data) - keep))
        assert "cannot be loaded (" in told(tmp_path, holed)


@pytest.mark.parametrize(
    "begins, said",
    [
        ("*(volatile int*)0 = 1;", "loading it crashes: Segmentation fault"),
        ("abort();", "loading it crashes: Aborted"),
        ("exit(0);", "loading it ends the program"),
        ('puts("noise");', None),
    ],
)
def test_what_a_library_does_when_it_is_loaded(tmp_path, begins, said):
    source = (
        "#include <stdio.h>\n#include <stdlib.h>\n__attribute__((constructor)) void begin(void)"
    )
    source += "{ %s }\n" % begins + hostile.UMAT % ""
    library = hostile.compiled(tmp_path, source, "begins")
    if said:
        assert said in told(tmp_path, library)
    else:  # a library that talks is one all the same
        assert estimated(tmp_path, library).returncode == 0


def test_a_whole_library_is_taken(tmp_path):
    """The negative control of all above."""
    done = estimated(tmp_path, hostile.umat(tmp_path, ""))
    assert done.returncode == 0, done.stderr
