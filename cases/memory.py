"""Memory that a process may still take."""

from pathlib import Path

NO_LIMIT = float("inf")


def available(root: Path = Path("/")) -> float:
    """What the kernel can give without swapping, or what the control group still allows where that
    is less [bytes]. cases/memory.cpp asks the same.
    """
    return min(of_machine(root), *of_groups(root))


def of_machine(root: Path) -> float:
    for line in (root / "proc/meminfo").read_text().splitlines():
        if line.startswith("MemAvailable:"):
            return 1024.0 * float(line.split()[1])
    return NO_LIMIT


def of_groups(root: Path) -> list[float]:
    """What the groups of this process, and those around them, still allow."""
    left = [NO_LIMIT]
    for folder in groups("memory", root):
        for names in (
            ("memory.max", "memory.current"),
            ("memory.limit_in_bytes", "memory.usage_in_bytes"),
        ):
            most, taken = (number_in(folder / name) for name in names)
            if most < NO_LIMIT and taken < NO_LIMIT:
                left.append(max(0.0, most - taken))
    return left


def groups(controller: str, root: Path) -> list[Path]:
    """Folders of the control groups of this process, and of those around them, in which a
    controller, such as memory or cpu, keeps its files; of either version of control groups.
    """
    listed = root / "proc/self/cgroup"
    found = []
    for line in listed.read_text().splitlines() if listed.exists() else []:
        number, controllers, path = line.split(":", 2)
        if number == "0" and not controllers:
            mount = root / "sys/fs/cgroup"
        elif controller in controllers.split(","):
            mount = root / "sys/fs/cgroup" / controllers
        else:
            continue
        here = mount / path.strip("/")
        for folder in [here, *here.parents]:
            found.append(folder)
            if folder == mount:
                break
    return found


def number_in(path: Path) -> float:
    try:
        return float(path.read_text())
    except (OSError, ValueError):  # no such file; the word "max"
        return NO_LIMIT
