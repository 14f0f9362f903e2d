"""Runs a module of this clone, or of Debian's Python, apart from whoever calls.

    /usr/bin/python3 -I -X utf8 cases/start.py [--parent PID] MODULE [WORD]...

-I leaves out the working folder, the user's own packages and every PYTHON… variable; -X utf8 reads
and writes text the same in every locale. What else of the caller's surroundings would decide how
the work is done is dropped here, for the module and for all that it starts. Where it is asked to
end, it clears up before; with --parent it does not outlive the process that started it.
"""

import os
import runpy
import signal
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


asked: list[int] = []  # signals that this process has heard


def leave(number, _frame):
    """Ends this process by way of what clears up; what is asked again meanwhile is not heard."""
    signal.signal(number, signal.SIG_IGN)
    asked.append(number)
    sys.exit(128 + number)


def interrupt(number, _frame):
    asked.append(number)
    raise KeyboardInterrupt


def interrupted():
    print(f"{name}: interrupted", file=sys.stderr)
    sys.exit(128 + signal.SIGINT)


if __name__ == "__main__":
    clean(os.environ)
    sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    from cases.children import die_with
    from cases.programs import user_cache

    if sys.argv[1] == "--parent":
        die_with(int(sys.argv[2]))
        del sys.argv[1:3]
    for one in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(one) == signal.SIG_DFL:  # nohup has one of them ignored
            signal.signal(one, leave)
    if signal.getsignal(signal.SIGINT) == signal.default_int_handler:
        signal.signal(signal.SIGINT, interrupt)

    if not os.access(os.environ.get("HOME", ""), os.W_OK):  # where matplotlib keeps its fonts' list
        os.environ.setdefault("MPLCONFIGDIR", str(user_cache() / "grainpair" / "matplotlib"))
    del sys.argv[0]
    name = sys.argv[0]
    try:
        runpy.run_module(name, run_name="__main__", alter_sys=True)
    except KeyboardInterrupt:
        interrupted()
    except Exception:  # h5py makes an ImportError of whatever ends its import
        if not asked:
            raise
        if asked[0] == signal.SIGINT:
            interrupted()
        sys.exit(128 + asked[0])
