"""Numbers in texts: one parser, which does not read what only Python takes for a number."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from pathlib import Path

import click
import pytest

import tunneldb
from tunneldb.alignment.landxml import _number as landxml_number
from tunneldb.cli.leaks import parse_clock
from tunneldb.cli.load import density_of
from tunneldb.cli.param_types import FINITE, FiniteRange, WholeRange
from tunneldb.cli.survey import DAY
from tunneldb.cli.tunnel import Srid
from tunneldb.csvfile import number_advice, read_csv
from tunneldb.errors import InputError, UserError
from tunneldb.numerals import parse_number, parse_whole, percent_number
from tunneldb.pointcloud.formats.text_lines import are_numbers
from tunneldb.stages.parameters import _value
from tunneldb.stages.run import km_range

STRANGE = ("272_000", "２７２", "1２", "٣", "1_0.5", "१")

READERS: dict[str, Callable[[str], object]] = {
    "number": parse_number,
    "whole": parse_whole,
    "option": lambda text: FINITE.convert(text, None, None),
    "range": lambda text: FiniteRange(0.0, 1e9).convert(text, None, None),
    "count": lambda text: WholeRange(0, 10**9).convert(text, None, None),
    "srid": lambda text: Srid().convert(text, None, None),
    "density": density_of,
    "day": lambda text: DAY.convert(f"{text}-05-04", None, None),
    "kilometre": km_range,
    "clock": lambda text: parse_clock(f"{text}-2"),
    "landxml": landxml_number,
    "parameter": lambda text: _value("axis.half_width", text),
}
PLAIN = {"clock": "10", "day": "2024", "landxml": "-1.5e3", "number": " 1.5 ", "parameter": "1.5", "srid": "25830"}


@pytest.mark.parametrize("reader", READERS)
def test_only_plain_digits_are_numbers(reader: str) -> None:
    READERS[reader](PLAIN.get(reader, "12"))
    for text in STRANGE:
        with pytest.raises((ValueError, UserError, click.ClickException)):
            READERS[reader](text)


@pytest.mark.parametrize("text", STRANGE)
def test_files_refuse_them_with_advice(tmp_path: Path, text: str) -> None:
    (tmp_path / "axis.csv").write_text(f"x,y\n1,2\n{text},4\n", "utf-8")
    with pytest.raises(InputError, match=f"axis.csv, line 3: x is '{text}', not a number"):
        read_csv(tmp_path / "axis.csv", ["x", "y"])
    assert not are_numbers(f"1 2 {text}")


def test_the_advice_helps() -> None:
    assert number_advice("272_000") == "; write it without separators of thousands"
    assert number_advice("２７２") == "; write it with the digits 0 to 9"
    assert number_advice("word") == ""


def _calls(tree: ast.AST) -> Iterator[ast.Name]:
    """float and int where a ValueError is expected, that is, where text is read."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Try) and any("ValueError" in ast.dump(handler) for handler in node.handlers):
            for statement in node.body:
                yield from (n for n in ast.walk(statement) if isinstance(n, ast.Name) and n.id in ("float", "int"))


def test_texts_are_read_as_numbers_in_one_place() -> None:
    root = Path(tunneldb.__file__).parent
    found = {
        f"{path.relative_to(root)}:{name.lineno}"
        for path in root.rglob("*.py")
        if path.name != "numerals.py" and path.parent.name != "database"  # files of the server
        for name in _calls(ast.parse(path.read_text("utf-8")))
    }
    assert found == set()
    of_click = [path.name for path in root.rglob("*.py") if "click.IntRange" in path.read_text("utf-8")]
    assert of_click == ["param_types.py"], "of which WholeRange is a kind"


@pytest.mark.parametrize(
    ("share", "decimals", "text"),
    [(0.0, 1, "0.0"), (0.0004, 1, "< 0.1"), (0.5, 1, "50.0"), (0.9994, 1, "99.9"), (0.9998, 1, "> 99.9"), (1.0, 1, "100.0"),
     (0.996, 0, "> 99"), (1.0, 0, "100")],
)  # fmt: skip
def test_a_share_is_all_or_nothing_only_if_it_is(share: float, decimals: int, text: str) -> None:
    assert percent_number(share, decimals) == text
