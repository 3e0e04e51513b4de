"""Downloads are what the commands write."""

from __future__ import annotations

import io
import tempfile
from pathlib import Path

import openpyxl
import psycopg
import pyogrio
import pytest
from web.conftest import SignIn


def test_geopackage_has_the_leaks(signed_in: SignIn, conn: psycopg.Connection, tmp_path: Path) -> None:
    answer = signed_in("olga_web").get("/api/surveys/demo-2024/export?what=gpkg")
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-disposition"] == 'attachment; filename="demo-2024.gpkg"'
    path = tmp_path / "a.gpkg"
    path.write_bytes(answer.content)
    assert "leak_map" in pyogrio.list_layers(path)[:, 0]


def test_workbook_of_a_stretch(signed_in: SignIn) -> None:
    answer = signed_in("olga_web").get("/api/surveys/demo-2024/export?what=xlsx&from=12340&to=12400")
    assert answer.headers["content-disposition"] == 'attachment; filename="demo-2024-12340-12400.xlsx"'
    book = openpyxl.load_workbook(io.BytesIO(answer.content))
    assert {"Findings", "Counts", "Could be missed"} <= set(book.sheetnames)


def test_report_is_a_download_and_no_page_of_the_desk(signed_in: SignIn) -> None:
    """Scripts of a report must not run with the rights of the desk."""
    answer = signed_in("olga_web").get("/api/surveys/demo-2024/export?what=report&from=12340&to=12360")
    assert answer.headers["content-disposition"].startswith("attachment")
    assert "demo-2024" in answer.text


@pytest.mark.parametrize("span", ["bytes=zz", "bytes=999999999-", "bytes=0-10"])
def test_no_file_stays_behind(signed_in: SignIn, span: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    signed_in("olga_web").get("/api/surveys/demo-2024/export?what=xlsx", headers={"Range": span})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("what", ["report", "xlsx", "gpkg"])
def test_downloads_need_an_operator(signed_in: SignIn, what: str) -> None:
    answer = signed_in("viola_web").get(f"/api/surveys/demo-2024/export?what={what}")
    assert (answer.status_code, answer.json()["error"]) == (403, "downloads need the role tunnel_operator")


@pytest.mark.parametrize("query", ["what=psql", "what=gpkg&from=20&to=10", "what=gpkg&from=90000&to=90001", ""])
def test_wrong_downloads_get_one_line(signed_in: SignIn, query: str) -> None:
    answer = signed_in("olga_web").get(f"/api/surveys/demo-2024/export?{query}")
    assert answer.status_code in (400, 404)
    assert answer.json()["error"]
