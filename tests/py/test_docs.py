"""What the documentation names exists: files, folders, commands, options, modules, keys, functions.

A name is what stands in code (`so`, or a block); files with an ending of source code and targets of
links are looked for outside of code, too. `<so>`, `…` and `*` stand for anything.
"""

import re
import tomllib
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ELSEWHERE = {"build", "runs", ".git", ".hypothesis", ".mypy_cache", ".pytest_cache", ".snakemake"}
SOURCE = {".py", ".hpp", ".cpp", ".toml", ".j2", ".in", ".txt", ".cmake", ".yaml", ""}
SOURCE |= {".c", ".h", ".f90"}
MADE = {".h5", ".html", ".json", ".pvd", ".vtu", ".csv", ".png"}  # files that runs write


def ours(file: Path) -> bool:
    return file.is_file() and not ELSEWHERE & set(file.relative_to(ROOT).parts)


# The changelog tells what was; it may name what is gone.
DOCUMENTS = sorted(
    file for file in ROOT.rglob("*.md") if ours(file) and file.name != "CHANGELOG.md"
)


@cache
def sources() -> dict[Path, str]:
    """Text of every source, this test and the documents not counted."""
    return {
        file: file.read_text()
        for file in sorted(ROOT.rglob("*"))
        if ours(file) and file.suffix in SOURCE and file != Path(__file__).resolve()
        if file.name not in ("LICENSE",) and "reference" not in file.parts
    }


@cache
def words_of_sources() -> set[str]:
    return {word for text in sources().values() for word in re.findall(r"\w+", text)}


@cache
def options() -> set[str]:
    """Every option that a program or a command declares."""
    return {
        word
        for text in sources().values()
        for word in re.findall(r'["\', ](--[a-z][a-z-]*)["\', =]', text)
    }


@cache
def schemas() -> tuple[dict, dict]:
    """Keys of scenes and of element tests, by table."""
    scene = tomllib.loads((ROOT / "cases" / "schema.toml").read_text())
    element = tomllib.loads((ROOT / "cases" / "element_schema.toml").read_text())
    return scene, element


def inline(text: str) -> list[str]:
    return re.findall(r"`([^`\n]+)`", re.sub(r"^```.*?^```", "", text, flags=re.S | re.M))


def lines_of_code(text: str) -> list[str]:
    """Lines of indented and fenced blocks, without their comments."""
    fenced = "\n".join(re.findall(r"^```\w*\n(.*?)^```", text, flags=re.S | re.M))
    indented = re.findall(r"^ {4}(\S.*)$", text, flags=re.M)
    return [re.sub(r"\s+#.*", "", line) for line in [*indented, *fenced.splitlines()]]


def pattern(name: str) -> str:
    return re.sub(r"<[^>]*>|…", "*", name)


def exists(name: str, document: Path) -> bool:
    """Whether a file or folder of that name is at the root, beside the document or below it."""
    wanted = pattern(name).strip("/")
    if wanted.startswith("../"):
        return (document.parent / wanted).exists()
    if document.is_relative_to(ROOT / "docs") and wanted in names_of_files():
        return True  # pages there speak of the whole clone
    return any(
        next(folder.glob(where + wanted), None) is not None
        for folder, where in ((ROOT, ""), (document.parent, ""), (document.parent, "**/"))
    )


def missing_command(line: str) -> str:
    """What is wrong with a line that calls something of ours; empty where it is right."""
    match line.replace("/usr/bin/", "").split():
        case ["./grainpair" | "grainpair", command, *_] if re.fullmatch(r"[a-z][\w-]*", command):
            file = f"{command.replace('-', '_')}.py"
            if not (ROOT / "compare" / "commands" / file).exists():
                return f"no command {command}"
        case ["python3", "-m", module, *_] if module not in ("pytest", "black"):
            place = ROOT.joinpath(*module.split("."))
            if not place.with_suffix(".py").exists() and not (place / "__main__.py").exists():
                return f"no module {module}"
        case [program, *_] if program.startswith("build/release/"):
            if program.removeprefix("build/release/") not in programs():
                return f"no program {program}"
    for option in re.findall(r"(?<![\w-])--[a-z][a-z-]*", line):
        if option not in options() | {"--help", "--version", "--preset", "--build"}:
            return f"no option {option}"
    for key in re.findall(r"--set (\w+\.\w+)=", line):
        if not is_key(key):
            return f"no key {key}"
    return ""


@cache
def programs() -> set[str]:
    """What CMake makes: executables by the names in add_executable, those of loops spelt out."""
    found = set()
    for file, text in sources().items():
        if file.name != "CMakeLists.txt":
            continue
        loops = re.findall(r"foreach\(name ([^)]*)\)(.*?)endforeach", text, flags=re.S)
        spelt = [body.replace("${name}", name) for names, body in loops for name in names.split()]
        found |= set(re.findall(r"add_executable\(([\w]+) ", text + "".join(spelt)))
    return found


def is_key(name: str) -> bool:
    table, _, key = name.partition(".")
    return any(key in schema.get(table, {}) for schema in schemas())


def missing(name: str, document: Path) -> str:
    """What a name in code claims and does not hold; empty where all is there."""
    bare = name.strip().rstrip("…").strip()
    if bare.startswith("/usr/"):
        return ""  # of the system
    if re.match(r"(\./)?grainpair |(/usr/bin/)?python3 -m |build/release/|--", bare):
        return missing_command(bare)
    key = re.match(r"([a-z]\w*)\.(\w+)(?: ?=.*)?$", bare)
    if key and key[1] in schemas()[0] and "." + key[2] not in MADE:
        return "" if is_key(f"{key[1]}.{key[2]}") else f"no key {bare}"
    place = re.fullmatch(r"(\S+\.(?:py|hpp|cpp)):(\w+)(\(\))?", bare)
    if place:
        files = [file for file in sources() if str(file).endswith("/" + place[1])]
        found = any(re.search(rf"\b{place[2]}\b", sources()[file]) for file in files)
        return "" if found else f"no {place[2]} in {place[1]}"
    path = re.fullmatch(r"[\w.<>*…/-]+", bare) and ("/" in bare or re.search(r"\.\w+$", bare))
    if path and not bare.startswith("/") and not bare.startswith(("runs", "build")):
        if exists(bare, document):
            return ""
        if bare.endswith("/") and (ROOT / bare.partition("/")[0]).is_dir():
            return f"no folder {bare}"
        if Path(bare).suffix not in MADE and not bare.endswith("/"):
            if "." in bare and re.fullmatch(r"[A-Z]\w+\.(\w+|\*)", bare):
                return ""  # a C++ test, which test_equations.py looks for
            if Path(bare).suffix[1:] in ("hpp", "cpp", "py", "toml", "md"):
                return f"no file {bare}"
    bare = re.sub(r"_\d+\b", "", bare)  # of files that are numbered
    parts = re.findall(r"\w+", re.sub(r"<[^>]*>|\.\w{2,4}\b", " ", bare))
    lost = [
        part
        for part in parts
        if len(part) > 2 and not part.isupper() and not part.isdigit() and not known(part)
    ]
    return f"nothing called {', '.join(lost)}" if lost else ""


def known(word: str) -> bool:
    """Whether a word stands in the sources, or is a file or a folder; `_word` may be an ending."""
    if word in words_of_sources() or word in names_of_files():
        return True
    if any(word.startswith(start) and known(word[len(start) :]) for start in starts_of_names()):
        return True
    return any(
        other.endswith(word) if word.startswith("_") else other.startswith(word)
        for other in words_of_sources() | names_of_files()
        if word.startswith("_") or word.endswith("_")
    )


@cache
def starts_of_names() -> set[str]:
    """What stands before a name that sources put together, as in f"profile_{name}"."""
    return {start for text in sources().values() for start in re.findall(r'f"([a-z]\w*_)\{', text)}


@cache
def names_of_files() -> set[str]:
    return {
        part
        for file in ROOT.rglob("*")
        if ours(file)
        for name in file.relative_to(ROOT).parts
        for part in (name, name.partition(".")[0])
    }


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda file: str(file.relative_to(ROOT)))
def test_every_name_in_code_exists(document):
    text = document.read_text()
    lost = [f"`{name}`: {why}" for name in inline(text) if (why := missing(name, document))]
    lost += [f"{line}: {why}" for line in lines_of_code(text) if (why := missing_command(line))]
    assert not lost, "\n".join(lost)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda file: str(file.relative_to(ROOT)))
def test_every_file_and_link_exists(document):
    text = document.read_text()
    prose = "\n".join(re.sub(r"^ {4}.*", "", line) for line in text.splitlines())
    prose = re.sub(r"^```.*?^```", "", prose, flags=re.S | re.M)
    named = set(re.findall(r"(?<![\w/])[\w*<>-]+(?:/[\w*<>-]+)*\.(?:hpp|cpp|py)\b", prose))
    linked = {
        link.partition("#")[0]
        for link in re.findall(r"\]\(([^)\s]+)\)", text)
        if not link.startswith(("http", "#"))
    }
    lost = [name for name in sorted(named | linked) if not exists(name, document)]
    assert not lost, lost


def test_every_path_that_a_comment_names_exists():
    """Of sources outside the tests, which make files up."""
    top = "|".join(folder.name for folder in ROOT.iterdir() if folder.is_dir())
    lost = {
        (str(file.relative_to(ROOT)), path)
        for file, text in sources().items()
        if file.relative_to(ROOT).parts[0] != "tests" and file.suffix in (".py", ".hpp", ".cpp")
        for path in re.findall(rf"\b((?:{top})/[\w/.-]*\.(?:hpp|cpp|py|toml|md|csv|txt))\b", text)
        # the build makes these two
        if not (ROOT / path).exists() and path not in ("mpm/version.hpp", "mpm/kernels.hpp")
    }
    assert not lost, lost


def test_every_folder_has_a_place_in_the_readme_and_every_case_in_the_docs():
    readme = (ROOT / "README.md").read_text()
    listed = (ROOT / "docs" / "reference" / "cases.md").read_text()
    cases = {file.parent.name for file in (ROOT / "cases").glob("*/case.toml")}
    assert {case for case in cases if f"`{case}`" not in listed} == set()
    folders = {f"{file.relative_to(ROOT).parts[0]}/" for file in sources()} & {
        f"{folder.name}/" for folder in ROOT.iterdir() if folder.is_dir() and folder.name[0] != "."
    }
    lost = {one for one in folders if f"`{one}`" not in readme and f"[{one[:-1]}](" not in readme}
    assert lost == set()
    assert len(readme.splitlines()) <= 100  # a minute's reading


def test_a_name_that_is_gone_is_noticed():
    """Of each kind one that does not exist; else the tests above could not fail."""
    document = ROOT / "README.md"
    for name in (
        "mpm/step/no_such.hpp",
        "no_such.py",
        "compare/no_such/",
        "mpm.no_such",
        "./grainpair nosuch",
        "./grainpair run --no-such",
        "python3 -m compare.nosuch",
        "build/release/no_such",
        "mpm/step/solver.hpp:no_such_thing",
        "No_Such::no_such_thing",
        "no_such_thing(a)",
    ):
        assert missing(name, document), name
