"""How the package compiles: by the decorators of `compiled.py`; nothing inner is called from Python, which would crash."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import tunneldb

ROOT = Path(__file__).parents[2]
PACKAGE = Path(tunneldb.__file__).parent
INNER, KERNELS = {"inner", "point_inner", "inner_sums"}, {"kernel", "point_kernel"}
FILES = [*sorted(PACKAGE.rglob("*.py")), *sorted((ROOT / "tests").rglob("*.py")), *sorted((ROOT / "benchmarks").rglob("*.py"))]


def decorators(node: ast.AST) -> set[str]:
    names = getattr(node, "decorator_list", [])
    return {name.id for name in names if isinstance(name, ast.Name)}


@cache
def inner_functions() -> set[str]:
    """Names of all inner functions; names that other functions have, too, are left out."""
    texts = [path.read_text("utf-8") for path in PACKAGE.rglob("*.py")]
    trees = [ast.parse(text) for text in texts if any(f"@{name}\n" in text for name in INNER)]
    made = [node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    inner = [node.name for node in made if decorators(node) & INNER]
    defined = re.findall(r"^ *def (\w+)", "\n".join(texts), re.MULTILINE)
    return {name for name in inner if defined.count(name) == inner.count(name)}


def calls_from_python(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Calls by name outside of compiled functions."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef) and decorators(node) & (INNER | KERNELS):
            continue
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            yield node.func.id, node.lineno
        yield from calls_from_python(node)


def test_there_are_inner_functions() -> None:
    assert len(inner_functions()) > 10


def test_nothing_inner_is_called_from_python() -> None:
    inner, found = inner_functions(), []
    calls = re.compile(rf"\b({'|'.join(inner)})\(")
    for path in FILES:
        text = path.read_text("utf-8")
        called = set(calls.findall(text))
        if not called:
            continue
        tree = ast.parse(text)
        nodes = list(ast.walk(tree))
        own = {node.name for node in nodes if isinstance(node, ast.FunctionDef) and not decorators(node) & INNER}
        own |= {node.asname for node in nodes if isinstance(node, ast.alias) and node.asname}
        # Rounds of blind scenes import their own functions so, the program none.
        own |= {name.name for node in nodes if isinstance(node, ast.ImportFrom) and node.level for name in node.names}
        if called <= own:
            continue
        found += [f"{path.name}:{line} {name}" for name, line in calls_from_python(tree) if name in inner - own]
    assert found == []


def test_only_the_decorators_of_the_room_compile() -> None:
    raw = [path for path in PACKAGE.rglob("*.py") if path.name != "compiled.py" and "njit" in path.read_text("utf-8")]
    assert raw == []
