"""Build the documentation as one site of static pages, which opens and searches without a network.

Tutorials, theory, results, and the reference that is made from the program itself: keys, metrics,
commands, failures. Whatever Sphinx warns of is an error. Sphinx comes from Debian,
packages-docs.txt; the launcher installs it for this command only.
"""

from pathlib import Path

from cases import results
from cases.programs import kept
from compare.pages import site

PACKAGES = ["docs"]
TARGETS = ["mpm_case"]


def arguments(parser):
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder of the site (runs/docs)")


def run(options) -> int:
    out = options.out or kept("docs")
    with results.prepared(out, site.OURS) as work:
        site.build(work)
    print(out / "index.html")
    return 0
