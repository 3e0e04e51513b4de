"""Tables of numbers as programs and people write them: the same numbers are read; what cannot be read is explained."""

from __future__ import annotations

from pathlib import Path

import pytest

from tunneldb.csvfile import read_csv, read_texts
from tunneldb.errors import UserError

ROWS = [[500.25, 60.5, -3.0], [510.0, 61.5, -2.5]]

SAME: dict[str, str | bytes] = {
    "byte order mark": "\ufeffx,y,z\n500.25,60.5,-3\n510,61.5,-2.5\n",
    "UTF-16 of Windows": "\ufeffx\ty\tz\r\n500,25\t60,5\t-3\r\n510\t61,5\t-2,5\r\n".encode("utf-16-le"),
    "Windows-1252": "x;y;z;Größe\n500.25;60.5;-3;1\n510;61.5;-2.5;1\n".encode("cp1252"),
    "capitals and units": "X [m], Y [m], Z(m)\n500.25, 60.5, -3\n510, 61.5, -2.5\n",
    "decimal commas": "x;y;z\n500,25;60,5;-3\n5,1e2;61,5;-2,5\n",
    "easting": "Easting,Northing,Height\n500.25,60.5,-3\n510,61.5,-2.5\n",
    "German": "Punkt;Hochwert;Rechtswert;Höhe\nA;60,5;500,25;-3\nB;61,5;510;-2,5\n",
    "comments": "# axis of tube 1\n\nx,y,z\n500.25,60.5,-3\n# bend\n510,61.5,-2.5\n// end\n",
    "header in a comment": "# tube 1\n#x y z\n500.25 60.5 -3\n510 61.5 -2.5\n",
    "a column #": "#;x;y;z\n1;500.25;60.5;-3\n2;510;61.5;-2.5\n",
    "separator of Excel": "sep=;\nx;y;z\n500.25;60.5;-3\n510;61.5;-2.5\n",
    "separators at the end": "x;y;z;\n500.25;60.5;-3;\n510;61.5;-2.5;\n",
    "end mark of DOS": b"x,y,z\r\n500.25,60.5,-3\r\n510,61.5,-2.5\r\n\x1a",
    "quotes": '"x";"y";"z"\n"500,25";"60,5";"-3"\n"510";"61,5";"-2,5"\n',
}  # fmt: skip


def write(path: Path, content: str | bytes) -> Path:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize("kind", SAME)
def test_a_table_however_written_has_the_same_numbers(kind: str, tmp_path: Path) -> None:
    assert read_csv(write(tmp_path / "a.csv", SAME[kind]), ("x", "y", "z")).values.tolist() == ROWS


REFUSED: dict[str, tuple[str, str]] = {
    "commas for points": ("x,y,z\n500,25,60,5,-3\n", "line 2: 5 values, but the header has 3 columns; write decimals with a"),
    "comma in quotes": ('x,y,z\n"500,25",60.5,-3\n', "line 2: x is '500,25', not a number; write decimals with a point"),
    "thousands": ("x;y;z\n4'640'000.5;1;1\n", "4'640'000.5\", not a number; write it without separators of thousands"),
    "thousands with points": ("# a\nx;y;z\n4.640.000,5;1;1\n", "line 3: x is '4.640.000,5', .* without separators"),
    "no number of Windows": ("x;y;z\n1;2;-nan(ind)\n", r"z is -nan\(ind\), not a plausible measurement; remove the line"),
    "empty": ("x;y;z\n1;2;\n", "line 2: z is empty; fill it in, or remove the line"),
    "two names": ("east;easting;y;z\n1;2;3;4\n", "east and easting may both be x; rename one of them to x"),
    "feet": ("x [ft];y [ft];z [ft]\n1;2;3\n", r"has no column x, y, z: the header is 'x \[ft\],"),
    "not a table": ("x,y,z\n1,2,\0\n", "is not a text file; save the table as CSV UTF-8"),
}  # fmt: skip


@pytest.mark.parametrize("kind", REFUSED)
def test_a_table_that_cannot_be_read_is_explained(kind: str, tmp_path: Path) -> None:
    content, message = REFUSED[kind]
    with pytest.raises(UserError, match=message):
        read_csv(write(tmp_path / "a.csv", content), ("x", "y", "z"))


def test_line_numbers_count_comments_and_blank_lines(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", "# a\n\nx,y\n1,2\n\n# b\n3,4\n")
    assert read_csv(path, ("x", "y")).lines.tolist() == [4, 7]


def test_words_that_are_not_unicode_are_refused_where_they_matter(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", "id;x;remark\nA;1;Tür\n".encode("cp1252"))
    assert read_texts(path, "id") == ["A"]
    with pytest.raises(UserError, match="line 2: 'Tür' is not written in UTF-8; save the table as CSV UTF-8"):
        read_texts(path, "remark")
    path.write_text(path.read_text("cp1252"), "utf-8")
    assert read_texts(path, "remark") == ["Tür"]
