"""The collapse as a plain LIGGGHTS script.

What runs where the library cannot be driven, and under MPI.

The trajectory is the library's, bit for bit, on one rank (run pieces without set-up do not disturb
each other); under MPI sums run in another order, and details differ. Contacts are seen only at
frames, so dissipation comes as a total from the balance, unsplit, and elastic and fluctuation
energy are interpolated between frames.
"""

import os
import shutil
import struct
import time
from pathlib import Path

import numpy as np

from cases import children
from cases.errors import CaseError
from cases.programs import unstarted

from . import plates, scene
from .audit import without_split
from .collapse import close, finish
from .plan import Plan
from .contacts import Snapshot
from .grains import Grains
from .moment import PLAIN_COLUMNS, ROLLING_COLUMNS, fluctuation_energy
from .output import Result
from .process import Report, home, last_error, refuse_full_disk, stopped
from .ranks import mpirun, outside_of_mpi
from .release import release

PROGRAM = "liggghts"
ATOMS = "id type x y z vx vy vz fx fy fz omegax omegay omegaz tqx tqy tqz"


def script(case: dict, grains: Grains, plan: Plan, packing: Path, work: Path) -> str:
    """The whole input: release, dumps, and a loop over frames that stops at rest."""
    columns = columns_of(grains)
    dumps = scene.render(
        "dumps",
        atoms=ATOMS + ("" if grains.even else " radius"),
        frame=plan.frame,
        columns=" ".join(f"c_pairs[{k + 1}]" for k in range(columns)),
        format=" ".join(["%.0f"] * 3 + ["%.17g"] * (columns - 3)),
    )
    begin = release(case, grains, plan, packing, work).removesuffix("run 0")
    loop = scene.render(
        "loop",
        frame=plan.frame,
        frames=plan.last // plan.frame,
        scale=plan.scale,
        rest=case["time"]["rest_kinetic_energy"],
    )
    return "\n".join([begin, dumps, "run 0", loop])


def command(ranks: int) -> list[str]:
    """The engine, under MPI for more than one rank; EngineError when it is not installed."""
    if not shutil.which(PROGRAM):
        raise unstarted(PROGRAM, FileNotFoundError())
    line = ["stdbuf", "-oL", PROGRAM]  # error lines are lost from a buffered stream
    return [*mpirun(ranks), *line] if ranks > 1 else line


def collapse_by_script(
    case: dict, packing: Path, log: Path, target: Path, attributes: dict, ranks: int, report: Report
) -> None:
    """As collapse.collapse, through a script in a process of its own."""
    began = time.monotonic(), sum(os.times()[2:4])
    if case["walls"]["gate"] == "lifted":
        raise CaseError(
            "walls.gate: a script cannot lift the gate (it has to be removed at the right moment) "
            "use the library"
        )
    grains, plan, work = Grains.of(case), Plan.of(case), log.parent
    (work / "collapse.in").write_text(script(case, grains, plan, packing, work))
    run_script(log, ranks, plan, report)
    history = thermo(log)
    steps = sorted(int(path.name.split(".")[1]) for path in work.glob("atoms.*.bin"))
    elastic, fluctuation, walls = [], [], plates.standing(case, grains)
    thickness = case["geometry"]["thickness"] if case["walls"]["front_back"] == "periodic" else None
    with Result(target, attributes) as result:
        for step in steps:
            shot = Snapshot(
                grains,
                read_atoms(work / f"atoms.{step}.bin"),
                read_contacts(work / f"pairs.{step}", columns_of(grains)),
                plan.dt,
                case["geometry"]["gravity"],
                thickness,
                walls,
            )
            result.frame(step, step * plan.dt, shot, case["output"]["contacts"])
            elastic.append(shot.held.elastic)
            radial = scene.axisymmetric(case)
            fluctuation.append(fluctuation_energy(shot.moment.atoms, grains, radial))
        rows = {
            name: history[:, k] for k, name in ((3, "kinetic"), (4, "rotational"), (5, "potential"))
        }
        rows["time"] = history[:, 0] * plan.dt
        rows["elastic"] = np.interp(history[:, 0], steps, elastic)
        rows["fluctuation"] = np.interp(history[:, 0], steps, fluctuation)
        rows["time_step"] = np.full(len(history), plan.dt)
        result.history(without_split(rows))
        reason = "rest" if steps[-1] < plan.last else "maximum"
        finish(result, packing, case, shot, plan, reason, steps[-1], (0.0, 0.0))
        cpu, wall = sum(os.times()[2:4]) - began[1], time.monotonic() - began[0]
        close(result, cpu, wall, {})  # the program does not tell its steps from its start and dumps


def run_script(log: Path, ranks: int, plan: Plan, report: Report) -> None:
    """Runs collapse.in beside `log`; EngineError with the engine's own words when it fails."""
    work = log.parent
    screen = work / "screen"
    with screen.open("w") as out:
        words = [*command(ranks), "-in", "collapse.in", "-log", log.name]
        around = outside_of_mpi() | {"HOME": home()}
        engine = children.start(words, cwd=work, env=around, stdout=out, stderr=out)
        try:
            while engine.poll() is None:
                report(len(list(work.glob("atoms.*.bin"))) * plan.frame / plan.last, "collapse")
                time.sleep(0.2)
        finally:
            children.end(engine)
    if engine.returncode:
        refuse_full_disk(work)
        raise stopped(engine.returncode, last_error(log, screen))


def thermo(log: Path) -> np.ndarray:
    """Rows of the log's thermo tables, repeated steps once.

    step, time, atoms, kinetic, rotational, potential.
    """
    rows = {}
    table = False
    for line in log.read_text(errors="replace").splitlines():
        words = line.split()
        if words[:2] == ["Step", "Time"]:
            table = True
        elif words[:2] == ["Loop", "time"]:
            table = False
        elif table and words and words[0].isdigit():  # not a warning
            rows[int(words[0])] = [float(word) for word in words]
    return np.array(list(rows.values()))


def read_atoms(path: Path) -> dict[str, np.ndarray]:
    """One frame of a binary custom dump.

    Step, n, triclinic, 6 boundaries, 6 box bounds, columns, chunks, then the chunks.
    """
    data = path.read_bytes()
    head = struct.Struct("<qqi6i6dii")
    columns, chunks = head.unpack_from(data)[-2:]
    offset, values = head.size, []
    for _ in range(chunks):
        (count,) = struct.unpack_from("<i", data, offset)
        values.append(np.frombuffer(data, np.float64, count, offset + 4))
        offset += 4 + 8 * count
    table = np.concatenate(values).reshape(-1, columns)
    atoms = {
        name: table[:, 2 + 3 * k : 5 + 3 * k].copy()
        for k, name in enumerate(("x", "v", "f", "omega", "torque"))
    }
    atoms |= {"id": table[:, 0].astype(np.int64), "type": table[:, 1].astype(np.int64)}
    return atoms | ({"radius": table[:, 17].copy()} if columns > 17 else {})


def columns_of(grains: Grains) -> int:
    """Columns of a contact."""
    return ROLLING_COLUMNS if grains.rolls else PLAIN_COLUMNS


def read_contacts(path: Path, columns: int) -> np.ndarray:
    """One frame of the local dump, as Liggghts.contacts gives them (n, columns)."""
    with path.open() as file:
        for line in file:
            if line.startswith("ITEM: ENTRIES"):
                break
        return np.loadtxt(file, ndmin=2).reshape(-1, columns)
