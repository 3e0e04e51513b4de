"""Generators that keep a statement of the database open are closed at the end of a block, whatever ends it."""

from __future__ import annotations

import ast
from pathlib import Path

import tunneldb

OPEN = ("cursor", "copy", "stream", "transaction")
"""Methods whose result must be closed before the connection is used again."""


def _opens(function: ast.FunctionDef) -> bool:
    """Return True for a generator that yields while something of the connection is open, and is not a context manager."""
    if not any(isinstance(node, (ast.Yield, ast.YieldFrom)) for node in ast.walk(function)):
        return False
    if any("contextmanager" in ast.dump(decorator) for decorator in function.decorator_list):
        return False
    blocks = [node for node in ast.walk(function) if isinstance(node, (ast.With, ast.For))]
    return any(
        _of_connection(block) and any(isinstance(n, (ast.Yield, ast.YieldFrom)) for n in ast.walk(block)) for block in blocks
    )


def _of_connection(block: ast.With | ast.For) -> bool:
    heads = [item.context_expr for item in block.items] if isinstance(block, ast.With) else [block.iter]
    return any(
        isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in OPEN
        for head in heads
        for node in ast.walk(head)
    )


def test_generators_with_an_open_statement_are_closed() -> None:
    """A COPY or a cursor left open by an error in the caller would block the rollback for ever."""
    texts = {path: path.read_text("utf-8") for path in Path(tunneldb.__file__).parent.rglob("*.py")}
    trees = {path: ast.parse(text) for path, text in texts.items() if "yield" in text}
    functions = [node for tree in trees.values() for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    names = {function.name for function in functions if _opens(function)}
    assert names == {"stream_findings", "read_fragment"}
    for path, text in texts.items():
        if not any(name in text for name in names):
            continue
        calls = [n for n in ast.walk(ast.parse(text)) if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)]
        closed = {id(a) for call in calls if call.func.id == "closing" for a in call.args}  # type: ignore[attr-defined]
        open_ = [call.lineno for call in calls if call.func.id in names and id(call) not in closed]  # type: ignore[attr-defined]
        assert not open_, f"{path}: {open_}"
