"""The documentation against the program: links, commands, parameters, paths and targets that it names must exist."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from support.command_lines import mistake

from tunneldb.classification.classes import PointClass
from tunneldb.stages.parameters import PARAMETERS

ROOT = Path(__file__).parents[2]
OUTSIDE = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")
PAGES = sorted([*(ROOT / name for name in OUTSIDE), *(ROOT / "docs").glob("*.md")])
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)\s]+)\)")
FOLDERS = ("benchmarks", "docs", "migrations", "scripts", "sql", "tests", "tunneldb")
pages = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)


def anchors(page: Path) -> set[str]:
    """Anchors of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", FENCE.sub("", page.read_text("utf-8")), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pages
def test_links_lead_somewhere(page: Path) -> None:
    dead = []
    for target in LINK.findall(FENCE.sub("", page.read_text("utf-8"))):
        if target.startswith(("http://", "https://")):
            continue
        path, _, anchor = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        if not file.exists() or (anchor and anchor not in anchors(file)):
            dead.append(target)
    assert not dead


def test_contents_lead_to_every_page() -> None:
    contents = ROOT / "docs" / "index.md"
    linked = {target.partition("#")[0] for target in LINK.findall(contents.read_text("utf-8"))}
    assert {page.name for page in contents.parent.glob("*.md")} - linked <= {contents.name}


def commands(page: Path) -> list[list[str]]:
    """Command lines of tunneldb: those of shell blocks, and those in the text."""
    text = page.read_text("utf-8")
    lines = [line for kind, code in FENCE.findall(text) if kind == "sh" for line in code.replace("\\\n", " ").splitlines()]
    lines += re.findall(r"`(tunneldb [^`]+)`", FENCE.sub("", text).replace("\n", " "))
    words = [shlex.split(line, comments=True) for line in lines if "tunneldb" in line]
    return [line[line.index("tunneldb") + 1 :] for line in words if "tunneldb" in line]


@pages
def test_commands_exist(page: Path) -> None:
    wrong = [f"tunneldb {' '.join(words)}: {found}" for words in commands(page) if (found := mistake(words))]
    assert not wrong


def test_mistakes_are_found() -> None:
    assert mistake(["leaks", "x", "--format", "csv", "-o", "y"]) is None
    assert mistake(["survey", "add", "--reference", "r.csv"]) is None
    assert mistake(["leek"]) == "there is no command leek"
    assert mistake(["tunnel", "add", "--reference"]) == "add has no option --reference"
    assert mistake(["run", "x", "--set", "section.step=5"]) == "there is no parameter section.step=5"


@pages
def test_parameters_exist(page: Path) -> None:
    prefixes = {name.partition(".")[0] for name in PARAMETERS}
    named = re.findall(r"`(\w+)\.(\w+)(?:=[^`]*)?`", page.read_text("utf-8"))
    assert {f"{a}.{b}" for a, b in named if a in prefixes and b not in ("sql", "py", "csv")} <= PARAMETERS.keys()


def test_classes_are_those_of_the_program() -> None:
    rows = re.findall(r"^\| (\d+) \| (\w+) \|", (ROOT / "docs" / "classes.md").read_text("utf-8"), re.MULTILINE)
    assert [(int(code), name) for code, name in rows] == [(int(klass), klass.name.lower()) for klass in PointClass]


@pages
def test_make_targets_exist(page: Path) -> None:
    there = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE))
    assert set(re.findall(r"(?:^|`)make (\w+)(?![\w=])", page.read_text("utf-8"), re.MULTILINE)) <= there


def gone(text: str) -> list[str]:
    """Paths of the project and modules of benchmarks that a text names between backquotes, or runs, and that are not there."""
    named = set(re.findall(rf"`((?:{'|'.join(FOLDERS)})/[^`\s]*)`", text))
    modules = {name.replace(".", "/") for name in re.findall(r"python -m (benchmarks\.\w+)", text)}
    named |= {f"{name}/__main__.py" if (ROOT / name).is_dir() else f"{name}.py" for name in modules}
    return sorted(path for path in named if path != "benchmarks/results/" and not (ROOT / path).exists())


@pages
def test_paths_exist(page: Path) -> None:
    assert gone(page.read_text("utf-8")) == []


def test_paths_that_are_gone_are_found() -> None:
    assert gone("`sql/install.txt`, `tunneldb/leaks/`, `python -m benchmarks.nothing --km 3`") == [
        "benchmarks/nothing.py",
        "tunneldb/leaks/",
    ]


def test_the_readme_takes_two_screens() -> None:
    lines = (ROOT / "README.md").read_text("utf-8").splitlines()
    assert len(lines) <= 120
    assert all(len(line) <= 128 for line in lines if not line.startswith("|"))
