"""The report's chapter on structures: of a site by itself, of a tunnel beside the rest."""

from __future__ import annotations

import json
import re
from pathlib import Path

import psycopg
import pytest
from support.command import output_of
from support.example_structures import add_example_site, save_example_structures


def rows(page: str, table: str) -> list[list[str]]:
    """Cells of the table that follows a heading."""
    body = page.split(f"<h3>{table}</h3>")[1].split("<tbody>")[1].split("</tbody>")[0]
    return [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in body.split("<tr")[1:]]


def test_a_site(conn: psycopg.Connection, tmp_path: Path) -> None:
    page = tmp_path / "hall.html"
    add_example_site(tmp_path)
    assert "tunneldb members hall-1" in output_of("report", "hall-1", "-o", page, code=2)
    assert not page.exists()
    save_example_structures(conn, "hall-1")
    assert "no chainage" in output_of("report", "hall-1", "-o", page, "--from", "0", code=2)
    conn.execute("UPDATE tunnel_api.spot SET review = 'rejected', remark = 'a <shadow>' WHERE number = 2")
    conn.commit()
    (tmp_path / "owner.toml").write_text('language = "sl"\nclient = "Hala"', "utf-8")
    assert "2 spots" in output_of("report", "hall-1", "-o", page, "--template", tmp_path / "owner.toml")
    assert {"<h2>Konstrukcije</h2>", "<dt>Naročnik</dt><dd>Hala</dd>"} <= set(
        re.findall("<h2>.*</h2>|<dt>.*</dd>", page.read_text())
    )
    output_of("report", "hall-1", "-o", page)
    text = page.read_text()
    listed = json.loads(output_of("spots", "hall-1", "--json"))
    # What was not seen stands before any number.
    warning, figures = text.index('id="unjudged"'), text.index('class="figures"')
    assert warning < figures
    assert listed["statement"][1:] in text[warning:figures]
    assert "more than half of member 2 differs" in text[warning:figures]
    assert "2 labels, 1 region of stray points left out" in text[warning:figures]
    assert f"<dd>{listed['count']}</dd>" in text[figures:]
    assert f"<dd>{listed['area']:.4f} " in text[figures:]
    spots = rows(text, "Spots")
    assert [row[0] for row in spots] == [str(spot["number"]) for spot in listed["spots"]]
    assert [float(row[5].replace("\u202f", "")) for row in spots] == [round(1e4 * spot["area"]) for spot in listed["spots"]]
    assert [row[10] for row in spots] == ['<i class="colour" style="background: rgb(120, 60, 30)"></i>120, 60, 30', "–", "–"]
    assert [(row[11], row[13]) for row in spots] == [("open", ""), ("rejected", "a &lt;shadow&gt;"), ("open", "")]
    members = rows(text, "Members")
    assert [(row[0], row[7], row[10]) for row in members] == [
        ("1", "1", ""),
        ("2", "1", "more than half differs"),
    ]
    assert "further member" not in text
    assert "spot 2</td>" in text, "the record of edits knows it by its number"

    # Pictures are to scale: the disc of 0.3 m on a wall of 3.4 m × 2 m, drawn where it lies.
    picture = text.split('id="member-1"')[1].split("</figure>")[0]
    paths = dict(re.findall(r'<path d="([^"]*)" class="[^"]*"><title>([^<]*)</title>', picture))
    boxes = {name: box(path) for path, name in paths.items()}
    scale = (boxes["face 2"][2] - boxes["face 1"][0]) / 3.4
    x0, y0, x1, y1 = boxes["spot 1"]
    assert (x1 - x0, y1 - y0) == pytest.approx((0.6 * scale, 0.6 * scale), rel=0.02)
    assert (x0 + x1) / 2 - boxes["face 1"][0] == pytest.approx(1.5 * scale, rel=0.01)
    assert (y0 + y1) / 2 - boxes["face 1"][1] == pytest.approx(1.0 * scale, rel=0.02)


def box(path: str) -> tuple[float, float, float, float]:
    at = [tuple(map(float, pair.split())) for pair in re.split("[MLZ]", path) if pair]
    xs, ys = [p[0] for p in at], [p[1] for p in at]
    return min(xs), min(ys), max(xs), max(ys)


def test_a_tunnel(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    output_of("report", "demo-2024", "-o", tmp_path / "without.html")
    assert "tructures" not in (tmp_path / "without.html").read_text()
    save_example_structures(conn, "demo-2024")
    conn.execute("UPDATE tunnel_api.spot SET review = 'confirmed' WHERE number = 3")
    conn.commit()
    output_of("report", "demo-2024", "-o", tmp_path / "with.html")
    text = (tmp_path / "with.html").read_text()
    assert [row[0] for row in rows(text, "Spots")] == ["1", "2", "3"]
    assert "Leaks one by one" in text


def test_a_stretch_of_a_tunnel(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    save_example_structures(conn, "demo-2024")
    # Of the wall one face of 4 m² lies before 12+400 and one of 2 m² behind it, each with a spot; the pipe has no chainage.
    conn.execute("UPDATE tunnel.member SET chainage = 12390 WHERE number = 1")
    for number, chainage in ((1, 12350.0), (2, 12450.0)):
        conn.execute("UPDATE tunnel.face SET chainage = %s WHERE number = %s", [chainage, number])
        conn.execute("UPDATE tunnel.spot SET chainage = %s WHERE number = %s", [chainage, number])
    conn.commit()
    for ends, spots, area in ((("--from", "12+400"), ["2"], "2.0"), (("--to", "12+400"), ["1"], "4.0")):
        output_of("report", "demo-2024", "-o", tmp_path / "part.html", *ends)
        text = (tmp_path / "part.html").read_text()
        assert [row[0] for row in rows(text, "Spots")] == spots
        assert [row[0] for row in rows(text, "Members")] == ["1"], "the member whose middle is elsewhere, for its spot"
        assert f"<dt>Faces</dt><dd>{area} " in text
        assert "0.9 m² of faces have no chainage" in text
        assert f"<title>spot {spots[0]}</title>" in text
        assert text.count("<title>spot ") == 1
