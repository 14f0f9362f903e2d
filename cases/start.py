"""Runs a module of this clone, or of Debian's Python, apart from whoever calls.

    /usr/bin/python3 -I -X utf8 cases/start.py MODULE [WORD]...

-I leaves out the working folder, the user's own packages and every PYTHON… variable; -X utf8 reads
and writes text the same in every locale. What else of the caller's surroundings would decide how
the work is done is dropped here, for the module and for all that it starts.
"""

import os
import runpy
import sys

FOREIGN = ("PYTHON", "SNAKEMAKE", "BASH_", "MPLBACKEND", "MATPLOTLIBRC")  # starts of names
FOLDERS = ("GRAINPAIR_BUILD", "GRAINPAIR_RUNS")  # programs that work in other folders read them too


def clean(environment) -> None:
    for name in list(environment):
        if name.startswith(FOREIGN):
            del environment[name]
    for name in FOLDERS:
        if environment.get(name):
            environment[name] = os.path.abspath(environment[name])


if __name__ == "__main__":
    clean(os.environ)
    sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    from cases.programs import user_cache

    if not os.access(os.environ.get("HOME", ""), os.W_OK):  # where matplotlib keeps its fonts' list
        os.environ.setdefault("MPLCONFIGDIR", str(user_cache() / "grainpair" / "matplotlib"))
    del sys.argv[0]
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
