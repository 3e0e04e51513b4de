"""Texts for people use plain technical English: no phrase of the list, no docstring that begins with a relative clause."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import click
import pytest

from tunneldb.cli.main import main

ROOT = Path(__file__).parents[2]
GENERATED = ("reference-cli.md", "reference-parameters.md", "reference-sql.md")
"""Pages written from the help, the parameters and the database's comments, which have scopes of their own."""

PHRASES: tuple[tuple[str, str], ...] = (
    (r"\btell(s|ing)?\b[^.|]{0,50}\bapart\b|\btold apart\b", "distinguish, classify, separate"),
    (r"\bh(old|olds|olding|eld)\b[^.|]{0,60}\bagainst\b", "compare with"),
    (r"\b(goes|go|going|went|gone) by\b", "depends on, uses"),
    (r"\btake[sn]? for\b|\btook for\b", "classified as"),
    (r"\bbe it\b", "also if"),
    (r"\bof wh(ich|om)\b", "two sentences"),
    (r"\bsuch as (have|are|lie|bear|hold)\b", "that have"),
    (r"\b(is|are|be) wanting\b|\bfor want of\b|\bwant of\b", "missing"),
    (r"\bcounted all the same\b|\ball the same\b", "included in the totals; still"),
    (r"\bto be known\b", "notes and limitations"),
    (r"\bdark,? but dry\b|\bdark spots?\b", "dry dark area"),
    (r"\b[Uu]nseen\b", "not inspected"),
    (r"\bowners?'s? dirt\b|\bdirt of (their|his|her|its) own\b", "site-specific soiling"),
    (r"\bteach(es)?\b|\btaught\b", "adapts to"),
    (r"\bappendages?\b", "fixtures in front of the lining"),
    (r"\bverbs?\b", "command"),
    (r"\bkeeps? (a |the )?class \d\b|\band no better\b", "meets class 4 only"),
    (r"\bso manieth\b", "every n-th"),
    (r"\bspeaks? (for|against)\b", "evidence for, evidence against"),
    (r"\bpoints? is none\b", "invalid"),
    (r"\bover the end of a (kilometre|survey)\b|\bover a kilometre's end\b", "across a kilometre boundary"),
    (r"\b(stands?|hangs?) before\b", "in front of"),
    (r"\b(mend|mends|mended|reckon|reckons|reckoned|withdraws?|withdrawn)\b", "fix, compute, remove"),
    (r"\bwhat (becomes|became) of\b", "handling of, changes of"),
    (r"\bwhere .{0,30}neighbours lead\b", "deviates from its neighbours"),
    (r"\b(nobody|nothing|none|no one) (can|could) tell\b|\bcan(no|')t be told\b|\bcan't tell\b", "unknown"),
    (r"\b(aside|off) of\b", "beside"),
    (r"\bput in force\b", "activate"),
    (r"\bWho (asks|wants|has|is|can|may|must|reads|edits|moves)\b(?![^.]*\?)", "users who, if you"),
)
"""Phrases that readers stumbled on, as regular expressions, and replacements."""

CODE = re.compile(
    r"^```[\s\S]*?^```$|``[^`]*``|`[^`]*`|--[a-z][a-z-]*|\]\([^)]*\)|^!\[.*$|\*[^*\n]+\*|\| appendage \||^\w+(, \w+)*( : .*)?$",
    re.MULTILINE,
)
"""Parts of a page that aren't its prose: code, names, targets of links, labels of other programs, names of parameters."""

VALUES = re.compile(r"\b(unseen|appendage)\b")
"""Values of columns, which comments and messages may name."""

RELATIVE = re.compile(r"(What|Whether|Of|How|Which|Where|Who|That|When|As|For|Those|Such|By)\b")
MAX_RELATIVE_SHARE = 0.005
"""Share of function docstrings that may begin with a relative clause."""


def pages() -> Iterator[tuple[str, str]]:
    """Yield the prose of the pages written by hand."""
    for page in [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]:
        if page.name not in GENERATED:
            yield page.name, CODE.sub(" ", page.read_text("utf-8"))


def helps(command: click.Command = main, name: str = "tunneldb") -> Iterator[tuple[str, str]]:
    """Yield the help of a command, of its options and of its subcommands."""
    options = "\n".join(p.help or "" for p in command.params if isinstance(p, click.Option))
    yield name, CODE.sub(" ", f"{command.help or ''}\n{options}")
    if isinstance(command, click.Group):
        context = click.Context(command)
        for child in command.list_commands(context):
            found = command.get_command(context, child)
            assert found is not None
            yield from helps(found, f"{name} {child}")


@cache
def modules() -> tuple[tuple[str, list[ast.AST]], ...]:
    """Return the modules of the package, each with the nodes of its syntax tree."""
    files = sorted((ROOT / "tunneldb").rglob("*.py"))
    return tuple((str(path.relative_to(ROOT)), list(ast.walk(ast.parse(path.read_text("utf-8"))))) for path in files)


def docstrings() -> Iterator[tuple[str, str]]:
    """Yield docstrings of modules, classes and functions."""
    for path, nodes in modules():
        for node in nodes:
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
                name = "" if isinstance(node, ast.Module) else f":{node.lineno} {node.name}"
                yield path + name, VALUES.sub(" ", CODE.sub(" ", ast.get_docstring(node) or ""))


def messages() -> Iterator[tuple[str, str]]:
    """Yield strings of the package with three words or more that are neither docstrings nor SQL."""
    for path, nodes in modules():
        bare = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
        texts = (node for node in nodes if isinstance(node, ast.Constant) and id(node) not in bare)
        for node in texts:
            text = node.value
            if isinstance(text, str) and len(text.split()) >= 3 and not re.search(r"\b(SELECT|WITH|FROM)\b", text):
                yield f"{path}:{node.lineno}", VALUES.sub(" ", CODE.sub(" ", text))


def comments() -> Iterator[tuple[str, str]]:
    """Yield the comments of the database's views, functions and columns."""
    for path in sorted((ROOT / "sql").rglob("*.sql")):
        for name, text in re.findall(r"COMMENT ON ([^']+?) IS\s+'((?:[^']|'')*)'", path.read_text("utf-8")):
            yield f"{path.relative_to(ROOT)} {' '.join(name.split())}", VALUES.sub(" ", text.replace("''", "'"))


SCOPES: dict[str, Callable[[], Iterator[tuple[str, str]]]] = {
    "pages": pages,
    "help": helps,
    "docstrings": docstrings,
    "messages": messages,
    "comments": comments,
}


SLOW = {"help", "docstrings", "messages"}
"""Scopes that import or parse the whole package."""


def found(texts: Iterator[tuple[str, str]]) -> list[str]:
    """Return phrases of the list in texts, with place and replacement."""
    return [
        f"{place}: {' '.join(match[0].split())!r}: write {replacement!r}"
        for place, text in texts
        for phrase, replacement in PHRASES
        for match in re.finditer(phrase, text)
    ]


@pytest.mark.parametrize("scope", [pytest.param(scope, marks=pytest.mark.slow if scope in SLOW else ()) for scope in SCOPES])
def test_no_phrase_of_the_list(scope: str) -> None:
    wrong = found(SCOPES[scope]())
    assert not wrong, "\n".join(wrong)


def test_phrases_are_found() -> None:
    texts = [("a", "It tells ground and lining apart, and holds them\nagainst a truth."), ("b", "It classifies ground.")]
    assert [line.partition(":")[0] for line in found(iter(texts))] == ["a", "a"]


@pytest.mark.slow
def test_function_docstrings_begin_with_a_verb() -> None:
    all_of_them = [
        f"{path}:{node.lineno} {text.splitlines()[0]}"
        for path, nodes in modules()
        for node in nodes
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and (text := ast.get_docstring(node))
    ]
    relative = [line for line in all_of_them if RELATIVE.match(line.partition(" ")[2])]
    assert len(relative) <= MAX_RELATIVE_SHARE * len(all_of_them), "\n".join(relative)
