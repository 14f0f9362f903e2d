"""Ask of a law what no path of a laboratory shows: does it turn with the point, keep energy, ...

LAW is a shared library, with what a case would say of it as options; or a case, whose law is asked,
whichever it is. The law runs in a process of its own: one that ends it, by a signal or by exit,
ends nothing else, and is said with what it was asked. A law of which something fails may still be
what a study needs; the table says what to expect of it.
"""

import signal
import subprocess
from pathlib import Path

from cases.errors import CaseError, EngineError
from cases.lookup import find_case
from cases.programs import ROOT, call, program

OPTIONS = {  # what a case would say of a library, as material.…
    "--interface": "umat, esm or grainpair (needed of a library)",
    "--symbol": "its function (default: the usual one of the interface)",
    "--constants": "numbers between commas",
    "--parameters-file": "a file of them",
    "--state-variables": "how many it has",
    "--initial-state": "numbers between commas",
    "--void-ratio-state": "which of them is the void ratio, counted from 1",
    "--stress-measure": "cauchy or kirchhoff",
}
LISTS = ("constants", "initial_state")
SCENE = ROOT / "cases" / "column_ci" / "case.toml"  # for grains and initial void ratio


def arguments(parser):
    parser.add_argument("law", metavar="LAW", help="a shared library (.so), or a case")
    for option, what in OPTIONS.items():
        parser.add_argument(option, default="", help=what)
    parser.add_argument(
        "--void-ratio", type=float, default=None, help="at the start (default: the case's)"
    )
    parser.add_argument(
        "--timeout", type=float, default=300.0, help="seconds it has to answer (%(default)g)"
    )
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="in place of the case's"
    )


def run(options) -> int:
    scene, sets = asked(options)
    words = [word for assignment in sets for word in ("--set", assignment)]
    try:
        done = call([program("mpm_law_test"), scene, *words], timeout=options.timeout)
    except subprocess.TimeoutExpired as late:
        said = (late.stdout or b"").decode(errors="replace").splitlines()
        raise EngineError(
            f"{options.law}: no answer within {options.timeout:g} s{while_asked(said)}"
        ) from late
    rows = [line.split("\t") for line in done.stdout.splitlines()]
    if done.returncode == 2:
        raise CaseError(done.stderr.strip().splitlines()[-1])
    if done.returncode != 0:
        raise ended(done, options.law)
    found = [row for row in rows if row[0] != "asking"]
    width = max(len(name) for _, name, _, _ in found)
    for verdict, name, figure, doc in found:
        print(f"{verdict}  {name:{width}}  {figure}" + (f"  ({doc})" if doc else ""))
    failing = [name for verdict, name, _, _ in found if verdict != "holds"]
    print(f"{len(found) - len(failing)} of {len(found)} hold")
    return 0 if not failing else 1


def asked(options) -> tuple[Path, list[str]]:
    """The case that holds the law, and what is set in it."""
    sets = list(options.set)
    if options.void_ratio is not None:
        sets.append(f"initial.void_ratio={options.void_ratio}")
    keys = [option[2:].replace("-", "_") for option in OPTIONS]
    given = {key: getattr(options, key) for key in keys if getattr(options, key)}
    if not options.law.endswith(".so"):
        if given:
            name = next(iter(given)).replace("_", "-")
            raise CaseError(f"--{name}: of a library (a case tells it) use --set material.{name}=…")
        return find_case(options.law), sets
    library = Path(options.law).absolute()
    if not library.is_file():
        raise CaseError(f"{options.law}: no such file (a shared library is asked for)")
    if "interface" not in given:
        raise CaseError(f"{options.law}: without --interface (umat, esm or grainpair)")
    sets += ["material.law=external", f"material.library={library}"]
    for name, value in given.items():
        if name == "parameters_file":
            value = str(Path(value).absolute())
        sets.append(f"material.{name}=" + (f"[{value}]" if name in LISTS else value))
    return SCENE, sets


def while_asked(lines: list[str]) -> str:
    """The last question that the law's process told of."""
    questions = [line.removeprefix("asking\t") for line in lines if line.startswith("asking\t")]
    return f" while it was asked for '{questions[-1]}'" if questions else ""


def ended(done: subprocess.CompletedProcess, law: str) -> EngineError:
    """What is said of a law that ended its process."""
    where = while_asked(done.stdout.splitlines())
    if done.returncode < 0:
        how = signal.strsignal(-done.returncode) or f"signal {-done.returncode}"
        return EngineError(f"{law}: ended its process by a signal ({how}){where}")
    said = done.stderr.strip().splitlines()
    why = said[-1] if said else "no word"
    return EngineError(f"{law}: ended its process with code {done.returncode}{where} ({why})")
