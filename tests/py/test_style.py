"""Sizes that keep code readable: of lines, of functions, of files.

A function may be longer than most if the comment right above it says why, as `long: <reason>`.
"""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
COLUMNS, FUNCTION, FILE = 100, 60, 400  # the most that are allowed: columns, lines, lines

SOURCES = sorted(
    file
    for folder in ("cases", "mpm", "dem_reference", "compare", "tests")
    for pattern in ("*.py", "*.hpp", "*.cpp")
    for file in (ROOT / folder).rglob(pattern)
)


def functions_of_python(text: str) -> list[tuple[str, int, int]]:
    """Name, first and last line of every function, decorators counted."""
    return [
        (node.name, min([node.lineno, *(d.lineno for d in node.decorator_list)]), node.end_lineno)
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.end_lineno
    ]


def blank(text: str) -> str:
    """C++ with comments, literals and preprocessor lines turned into blanks, line by line."""
    kinds = (
        r"//[^\n]*",
        r"/\*.*?\*/",
        r'R"(?P<mark>\w*)\(.*?\)(?P=mark)"',
        r'"(?:\\.|[^"\\\n])*"',
        r"(?<!\w)'(?:\\.|[^'\\\n])+'",
        r"^[ ]*#(?:[^\n]*\\\n)*[^\n]*",
    )
    return re.sub(
        "|".join(kinds),
        lambda found: re.sub(r"[^\n]", " ", found[0]),
        text,
        flags=re.DOTALL | re.MULTILINE,
    )


def functions_of_cpp(text: str) -> list[tuple[str, int, int]]:
    """Name, first and last line of every function that is not inside another one.

    Told by braces, not by a compiler: a block outside of functions whose head has parentheses is a
    function's, unless the head starts as a namespace's or a type's does. What lies inside, lambdas
    too, counts as part of it. A brace without a blank before it is an initialiser's.
    """
    code = blank(text)
    found: list[tuple[str, int, int]] = []
    stack: list[str] = []
    head = 0  # where the text before the next block starts
    for at, sign in enumerate(code):
        if sign == "{":
            words = code[head:at].strip()
            kind = "other"
            if "function" in stack:
                kind = "inner"
            elif at and not code[at - 1].isspace():
                kind = "initialiser"
            elif not re.match(
                r"(template\s*<[^{}]*>\s*)?(inline )?(namespace|class|struct|enum|union)\b", words
            ):
                kind = "function" if "(" in words else "other"
            if kind == "function":
                name = re.search(r"([\w:~]+)\s*\(", words)
                begin = head + len(code[head:at]) - len(code[head:at].lstrip())
                found.append((name[1] if name else "?", code.count("\n", 0, begin) + 1, 0))
            stack.append(kind)
            if kind != "initialiser":
                head = at + 1
        elif sign == "}" and stack:
            kind = stack.pop()
            if kind == "function":
                found[-1] = (*found[-1][:2], code.count("\n", 0, at) + 1)
            if kind != "initialiser":
                head = at + 1
        elif sign == ";" and "function" not in stack:
            head = at + 1
    return found


def has_reason(lines: list[str], first: int) -> bool:
    """Whether the comment that ends right above line `first` says `long:` and why."""
    above = first - 2
    while above >= 0 and re.match(r"\s*(#|//)", lines[above]):
        if re.search(r"\blong: \w", lines[above]):
            return True
        above -= 1
    return False


def too_long(file: Path) -> list[str]:
    text = file.read_text()
    functions = functions_of_python(text) if file.suffix == ".py" else functions_of_cpp(text)
    return [
        f"{file.relative_to(ROOT)}:{first}: {name} has {last - first + 1} lines"
        for name, first, last in functions
        if last - first + 1 > FUNCTION and not has_reason(text.splitlines(), first)
    ]


def test_no_line_is_wider_than_the_page():
    wide = [
        f"{file.relative_to(ROOT)}:{number}: {len(line)} columns"
        for file in SOURCES
        for number, line in enumerate(file.read_text().splitlines(), start=1)
        if len(line) > COLUMNS
    ]
    assert not wide, "\n".join(wide)


def test_numbers_that_programs_read_are_written_as_pythons_own():
    """NumPy 2 tells its own by their types: `x={np.float64(1)!r}` is x=np.float64(1.0)."""
    bare = re.compile(r"= ?\{(?!float\()[^{}]*!r\}")
    assert bare.search('f"x={y!r}"') and not bare.search('f"x={float(y)!r}"')
    found = [
        f"{path.relative_to(ROOT)}:{number}"
        for folder in ("cases", "compare", "dem_reference")
        for path in sorted((ROOT / folder).rglob("*.py"))
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if bare.search(line) and "Error(" not in line
    ]
    assert not found


def test_no_file_is_long():
    lengths = {str(file.relative_to(ROOT)): len(file.read_text().splitlines()) for file in SOURCES}
    assert {name: length for name, length in lengths.items() if length > FILE} == {}


def test_no_function_is_long_without_a_reason():
    found = [finding for file in SOURCES for finding in too_long(file)]
    assert not found, "\n".join(found)


PYTHON = """
{comment}
@decorated
def f(a):
    {body}
"""
CPP = """
namespace n {{
struct S {{
  int a{{0}};
  {comment}
  template <class T>
  S(int b, const char* c = "{{") : a{{b}}, d{{1}} {{  // }}
    if (a > '}}') {{ g([] {{ return 0; }}); }}
    {body}
  }}
  int d{{2}};
}};
void g(int) {{}}
}}
"""


@pytest.mark.parametrize(
    "source, functions, comment, body",
    [
        (PYTHON, functions_of_python, "#", "pass\n    "),
        (CPP, functions_of_cpp, "//", ";\n    "),
    ],
)
def test_a_long_function_is_seen_and_a_reason_counts(source, functions, comment, body):
    text = source.format(comment=f"{comment} plain", body=body * 60)
    first = next(entry for entry in functions(text) if entry[2] - entry[1] > FUNCTION)
    assert first[0] in ("f", "S")
    assert not has_reason(text.splitlines(), first[1])
    reasoned = source.format(comment=f"{comment} long: one table", body=body * 60)
    assert has_reason(reasoned.splitlines(), first[1])
    short = functions(source.format(comment=comment, body=body))
    assert short and all(last - begin < FUNCTION for _, begin, last in short)
