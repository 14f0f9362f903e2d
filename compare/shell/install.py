"""Installs what leads to this clone, which stays where it is: python3 -m compare.shell.install
PREFIX.

Below PREFIX: the command, its manual page, completions, and a line on Python's path that finds
`import grainpair`. CMake calls it (compare/shell/install.cmake).
"""

import os
import site
import sys
from pathlib import Path

from cases.command_line import Parser
from cases.errors import CaseError, exit_code
from cases.files import replacing, write_atomically
from cases.programs import ROOT
from cases.scratch import reason
from compare import version
from compare.shell import completion, man, surface

LINK = Path("bin") / "grainpair"


def files() -> dict[Path, str]:
    """What is written, by its place below the prefix; modules.pth apart."""
    known = surface.commands()
    return {
        Path("share/man/man1/grainpair.1"): man.page(known, version.number()),
        Path("share/bash-completion/completions/grainpair"): completion.script("bash", known),
        Path("share/grainpair/completion.zsh"): completion.script("zsh", known),
    }


def modules(prefix: Path) -> Path:
    """Where Debian's Python looks for modules that are installed by hand below a prefix."""
    if prefix.resolve() == Path(site.getuserbase()).resolve():
        return Path(site.getusersitepackages())
    return prefix / "lib" / f"python{sys.version_info[0]}.{sys.version_info[1]}" / "dist-packages"


def install(prefix: Path) -> list[Path]:
    """Returns what was written. Raises CaseError where that cannot be."""
    if "\n" in str(ROOT):
        raise CaseError(f"{ROOT}: cannot be on Python's path (its name has several lines)")
    path = modules(prefix) / "grainpair.pth"
    wanted = {prefix / place: text for place, text in files().items()}
    wanted[path] = f"{ROOT / 'compare' / 'python'}\n"
    link = prefix / LINK
    try:
        for target, text in wanted.items():
            target.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(target, text)
        link.parent.mkdir(parents=True, exist_ok=True)
        with replacing(link) as part:
            part.symlink_to(ROOT / "grainpair")
    except OSError as error:
        raise CaseError(f"{prefix}: cannot be installed to ({reason(error)})") from error
    return [link, *wanted]


def main(words: list[str]) -> int:
    parser = Parser(prog="compare.shell.install", description="Installs what leads to this clone.")
    parser.add_argument("prefix", type=Path, metavar="PREFIX", help="such as /usr/local")
    options = parser.parse_args(words)

    def work() -> int:
        print(*install(Path(os.path.abspath(options.prefix))), sep="\n")
        return 0

    return exit_code(work)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
