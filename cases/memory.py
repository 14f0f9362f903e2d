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
    listed = root / "proc/self/cgroup"
    left = [NO_LIMIT]
    for line in listed.read_text().splitlines() if listed.exists() else []:
        number, controllers, path = line.split(":", 2)
        if number == "0" and not controllers:
            mount, names = root / "sys/fs/cgroup", ("memory.max", "memory.current")
        elif controllers == "memory":
            mount = root / "sys/fs/cgroup/memory"
            names = ("memory.limit_in_bytes", "memory.usage_in_bytes")
        else:
            continue
        here = mount / path.strip("/")
        for folder in [here, *here.parents]:
            most, taken = (number_in(folder / name) for name in names)
            if most < NO_LIMIT and taken < NO_LIMIT:
                left.append(max(0.0, most - taken))
            if folder == mount:
                break
    return left


def number_in(path: Path) -> float:
    try:
        return float(path.read_text())
    except (OSError, ValueError):  # no such file; the word "max"
        return NO_LIMIT
