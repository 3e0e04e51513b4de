"""Lists as CSV: nothing in them is a formula to a spreadsheet, and all of it comes back."""

from __future__ import annotations

import csv
import io
import tempfile
from pathlib import Path

from hypothesis import example, given
from hypothesis import strategies as st

from tunneldb.csvfile import read_texts, write_csv

TEXT = st.text(st.characters(codec="utf-8", exclude_categories=("Cs", "Cc")), max_size=20).map(str.strip)


@given(st.lists(TEXT, min_size=1, max_size=5))
@example(["=HYPERLINK(1)", "+cmd|' /C calc'!A0", "-1+1", "@SUM(A1)", "'=1", "'", "-0+010.5", "-2.5", "wet"])
def test_text_comes_back_and_none_is_a_formula(texts: list[str]) -> None:
    written = write_csv(["id", "remark"], [[n, text] for n, text in enumerate(texts)])
    for _, cell in list(csv.reader(io.StringIO(written)))[1:]:
        assert not cell.startswith(("=", "@", "\t"))
        assert not cell.startswith(("+", "-")) or not any(letter.isalpha() or letter == "|" for letter in cell)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "list.csv"
        path.write_text(written, encoding="utf-8")
        assert read_texts(path, "remark") == texts
