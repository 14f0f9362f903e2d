"""Show every figure the documentation states; --quick measures again those that take seconds."""

import importlib
import json
import tomllib
from functools import cache
from typing import Any

from cases.errors import CaseError, EngineError
from cases.programs import ROOT, call, module, own

PACKAGES = {"--quick": ["studies"]}
CLAIMS = ROOT / "cases" / "claims"
RELATIONS = {
    "equal": lambda measured, claim: abs(measured - claim["value"]) <= claim["tolerance"],
    "at_most": lambda measured, claim: measured <= claim["value"],
    "at_least": lambda measured, claim: measured >= claim["value"],
}


def arguments(parser):
    parser.add_argument(
        "--quick",
        action="store_true",
        help="measure again what takes seconds; exit code 1 where a figure no longer holds",
    )


def targets(words: list[str]) -> list[str]:
    return ["programs"] if "--quick" in words else []


def run(options) -> int:
    claims = read()
    if not options.quick:
        for claim in claims:
            print(
                f"{claim['id']}\n    {claim['statement']}\n"
                f"    {figure(claim)}; target: {claim['target']}\n    {claim['command']}"
            )
        return 0
    broken = 0
    for claim in claims:
        if not claim["quick"]:
            continue
        measured = measure(claim["measure"])
        holds = RELATIONS[claim["relation"]](measured, claim)
        broken += not holds
        print(
            f"{'holds ' if holds else 'BROKEN'}  {claim['id']:<40} "
            f"measured {measured:.6g}, stated {figure(claim)}"
        )
    print(f"grainpair claims: {broken} no longer hold" if broken else "grainpair claims: all hold")
    return int(broken > 0)


def read() -> list[dict]:
    """Every claim of cases/claims/*.toml.

    Raises CaseError for one that is incomplete or measures nothing.
    """
    claims = []
    for file in sorted(CLAIMS.glob("*.toml")):
        for claim in tomllib.loads(file.read_text()).get("claim", []):
            claim = {"relation": "equal", "quick": False} | claim
            needed = ["id", "statement", "target", "value", "unit", "command"]
            needed += ["tolerance", "reason"] if claim["relation"] == "equal" else []
            needed += ["measure"] if claim["quick"] else []
            for key in needed:
                if key not in claim:
                    raise CaseError(f"{file}: claim '{claim.get('id', '?')}' has no '{key}'")
            if claim["relation"] not in RELATIONS:
                raise CaseError(
                    f"{file}: claim '{claim['id']}' has the unknown relation '{claim['relation']}' "
                    f"(known: {', '.join(RELATIONS)})"
                )
            claims.append(claim)
    ids = [claim["id"] for claim in claims]
    for name in ids:
        if ids.count(name) > 1:
            raise CaseError(f"{CLAIMS}: two claims are called '{name}'")
    return claims


def figure(claim: dict) -> str:
    sign = {"equal": "", "at_most": "at most ", "at_least": "at least "}[claim["relation"]]
    spread = f" ± {claim['tolerance']:g}" if claim["relation"] == "equal" else ""
    return f"{sign}{claim['value']:g}{spread} {claim['unit']}"


def measure(reference: str) -> float:
    """The number a reference names.

    Either "case key.engine" of metrics.json, or a function "package.module.function".
    """
    match reference.split():
        case [name, key]:
            value: Any = metrics(name)
            for word in key.split("."):
                value = value[word]
            return float(value)
        case [dotted]:
            module, function = dotted.rsplit(".", 1)
            return float(getattr(importlib.import_module(module), function)())
    raise CaseError(f"{CLAIMS}: '{reference}' is neither 'case key' nor a function")


@cache
def metrics(name: str) -> dict:
    """metrics.json of a fresh run of a case."""
    from compare.verdict.conclusion import INVALID  # needs packages; `targets` is asked before

    out = own("runs", "claims", name)
    done = call(module("compare", "run", name, "--out", out, "--quiet"))
    if done.returncode not in (0, INVALID):  # claims state losses, too, that make a result invalid
        raise EngineError(done.stderr.strip())
    return json.loads((out / "metrics.json").read_text())
