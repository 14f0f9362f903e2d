"""Show the manual page; in a file or a pipe, its source.

The page is made of the commands' own help.
"""

import shutil
import sys

from cases.programs import call
from cases.scratch import temporary
from compare import version
from compare.shell import man, surface

TARGETS = ()


def arguments(parser):
    pass


def run(options) -> int:
    page = man.page(surface.commands(), version.number())
    if not sys.stdout.isatty() or not shutil.which("man"):
        print(page, end="")
        return 0
    with temporary() as folder:
        file = folder / "grainpair.1"
        file.write_text(page)
        return call(["man", file], stdout=None, stderr=None).returncode
