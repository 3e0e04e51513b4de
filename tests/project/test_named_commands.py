"""Commands and options that the program's own texts name: messages, notes, help and comments of the database."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

from support.command_lines import all_options, mistake

ROOT = Path(__file__).parents[2]
OTHERS = {
    "cli/psql.py", "database/binaries.py", "database/server.py", "report/pdf.py",
}  # fmt: skip
"""Files that run other programs, with options of theirs."""

PIP = "--upgrade"
PROSE = {"and", "as", "does", "finding", "in", "is", "needs", "nor", "reads", "recompute", "that", "when", "yet"}
"""Words that follow the program's name in sentences and captions."""

COMMAND = re.compile(r"\btunneldb ([a-z][a-z-]*\b[^;:(),\"`\b]*)")
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")


def literal(node: ast.AST) -> str | None:
    """Return the text of a string, in which the word VALUE stands for each value."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(str(part.value) if isinstance(part, ast.Constant) else "VALUE" for part in node.values)
    return None


@cache
def texts() -> list[tuple[str, str]]:
    """Return the place and the text of each string of the program, and of each line of SQL."""
    found = []
    for path in sorted((ROOT / "tunneldb").rglob("*.py")):
        place, content = str(path.relative_to(ROOT / "tunneldb")), path.read_text("utf-8")
        if "tunneldb " not in content and not OPTION.search(content):
            continue
        tree = ast.parse(content)
        inside = {part for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
        nodes = [node for node in ast.walk(tree) if isinstance(node, ast.Constant | ast.JoinedStr) and node not in inside]
        found += [(f"{place}:{node.lineno}", text) for node in nodes if (text := literal(node))]
    for path in sorted((ROOT / "sql").rglob("*.sql")):
        lines = enumerate(path.read_text("utf-8").splitlines(), start=1)
        found += [(f"{path.name}:{number}", line) for number, line in lines if not line.lstrip().startswith("--")]
    return found


def wrong_commands(text: str) -> list[str]:
    """Return the mistakes of the command lines in a text."""
    found = []
    for line in COMMAND.findall(text):
        words = re.sub(r"['\\]|--set \S*VALUE\S*|\.(?=\s|$).*| -- .*", " ", line, flags=re.DOTALL).split()
        if words[0] not in PROSE and (fault := mistake([word for word in words if word != "--VALUE"])):
            found.append(f"tunneldb {' '.join(words)}: {fault}")
    return found


def test_options_exist() -> None:
    known = all_options() | {PIP}
    named = [(place, name) for place, text in texts() if place.partition(":")[0] not in OTHERS for name in OPTION.findall(text)]
    assert len(named) > 500
    assert not [f"{place}: {name}" for place, name in named if name not in known]


def test_commands_exist() -> None:
    assert not [f"{place}: {fault}" for place, text in texts() for fault in wrong_commands(text)]


def test_wrong_commands_are_found() -> None:
    assert wrong_commands("not run yet: tunneldb run VALUE --from axis") == []
    assert wrong_commands("see tunneldb leek VALUE; or not") == ["tunneldb leek VALUE: there is no command leek"]
    assert wrong_commands("type tunneldb tunnel add --reference FILE") == [
        "tunneldb tunnel add --reference FILE: add has no option --reference"
    ]
