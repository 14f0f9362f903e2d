"""The site: every Markdown page of the clone and the generated ones, built by Sphinx.

Pages keep their places, so a link that works in the clone works in the site. Nothing that the site
needs comes from a network.
"""

import re
import shutil
import sys
from pathlib import Path

from cases import provenance
from cases.errors import CaseError, EngineError
from cases.programs import ROOT, call, module
from cases.scratch import temporary
from compare.pages import reference

DOCS = ROOT / "docs"
FOLDERS = ("cases", "compare", "dem_reference", "docs", "mpm")
MADE = Path("docs") / "reference"  # where generated pages go
# What a site holds at its top, replaced as a whole by the next one.
OURS = ("*.html", "searchindex.js", "_static", "_images", "_downloads", *FOLDERS)
START = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>grainpair</title>
<meta http-equiv="refresh" content="0; url=docs/index.html"></head>
<body><a href="docs/index.html">grainpair</a></body></html>
"""


def pages() -> list[Path]:
    """Every page that is committed, relative to the clone."""
    below = [file for folder in FOLDERS for file in (ROOT / folder).rglob("*.md")]
    return sorted(file.relative_to(ROOT) for file in [*ROOT.glob("*.md"), *below])


def links(text: str) -> list[str]:
    """Targets of the links and pictures of a page that are files."""
    found = re.findall(r"\]\(([^)\s]+)\)", text)
    return [
        link.partition("#")[0]
        for link in found
        if not link.startswith(("http://", "https://", "mailto:", "#"))
    ]


def hidden_list(names: list[str]) -> str:
    """Pages, from the root of the site, that a page has below itself."""
    return "\n```{toctree}\n:maxdepth: 1\n\n" + "".join(f"/{name}\n" for name in names) + "```\n"


def stage(folder: Path):
    """Lays all pages out in `folder`, with the files that they link to."""
    found = pages()
    for page in found:
        text = (ROOT / page).read_text()
        place = folder / page
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text)
        for link in links(text):
            file = (ROOT / page.parent / link).resolve()
            if file.suffix == ".md" or not file.is_relative_to(ROOT):
                continue
            if not file.is_file():
                raise CaseError(f"{page}: a link to {link} (no such file)")
            target = folder / file.relative_to(ROOT)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(file, target)
    for name, write in reference.PAGES.items():
        (folder / MADE / f"{name}.md").write_text(write())
    messages = [str(page.with_suffix("")) for page in found if page.name == "MESSAGES.md"]
    with (folder / MADE / "index.md").open("a") as index:
        index.write(hidden_list([*(str(MADE / name) for name in reference.PAGES), *messages]))
    others = [page for page in found if page.parts[0] not in ("docs", "README.md", "RESULTS.md")]
    with (folder / "docs" / "folders.md").open("a") as index:
        index.write(hidden_list([str(page.with_suffix("")) for page in others]))


def build(out: Path):
    """Makes the site in `out`. Raises CaseError with the first that Sphinx warns of, after the
    others have been printed; EngineError where it is not installed.
    """
    with temporary() as scratch:
        source = scratch / "pages"
        source.mkdir()
        stage(source)
        version = provenance.commit()
        words = ["-W", "--keep-going", "-q", "-b", "html", "-c", DOCS, "-d", scratch / "trees"]
        words += ["-D", f"version={version}", "-D", f"release={version}", source, out]
        done = call(module("sphinx", *words))
    if "No module named" in done.stderr and "sphinx" in done.stderr:
        raise EngineError("docs: Sphinx is missing (not installed) install packages-docs.txt")
    if done.returncode:
        told = list(dict.fromkeys(done.stderr.replace(f"{source}/", "").strip().splitlines()))
        print(*told[1:], sep="\n", file=sys.stderr)
        raise CaseError(f"{told[0] if told else 'docs'}: (Sphinx, {len(told)} lines) mend the page")
    for name in (".buildinfo", "objects.inv"):
        (out / name).unlink(missing_ok=True)
    (out / "index.html").write_text(START)
