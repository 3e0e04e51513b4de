"""Photos of findings by requests: stored once, clean, and shown to those who may see them."""

from __future__ import annotations

import base64
import hashlib
import io
import os
import re
from pathlib import Path
from typing import Any

import psycopg
import pytest
from PIL import Image, ImageCms
from starlette.testclient import TestClient
from support.photo_files import BLUE, RED, SERIAL, TAKEN, bomb, near, opened, photo
from web.conftest import SignIn
from web.test_findings import POLYGON

from tunneldb.web import photos
from tunneldb.web.config import Desk
from tunneldb.web.security import MAX_BODY, MAX_PHOTO

PATH = "/api/findings/1/photos"


def send(browser: TestClient, content: bytes, path: str = PATH, kind: str = "image/jpeg") -> Any:
    return browser.post(path, content=content, headers={"Content-Type": kind})


def sent(browser: TestClient, content: bytes, path: str = PATH) -> dict[str, Any]:
    """Add a photo; return it as the finding lists it."""
    answer = send(browser, content, path)
    assert answer.status_code == 201, answer.text
    return answer.json()["photos"][-1]


def rows(conn: psycopg.Connection) -> list[tuple[Any, ...]]:
    conn.rollback()
    return conn.execute("SELECT finding_id, path, caption, added_by FROM tunnel_api.finding_photo ORDER BY id").fetchall()


def files(conn: psycopg.Connection) -> int:
    conn.rollback()
    row = conn.execute("SELECT count(*) FROM tunnel.photo_file").fetchone()
    assert row is not None
    return int(row[0])


@pytest.fixture(params=["database", "folder"])
def place(request: pytest.FixtureRequest, desk: Desk, tmp_path: Path) -> str:
    """Place of uploaded photos."""
    desk.photos = tmp_path if request.param == "folder" else None
    return str(request.param)


def test_a_photo_is_upright_and_without_place_and_serial_number(
    place: str, signed_in: SignIn, conn: psycopg.Connection, tmp_path: Path
) -> None:
    browser = signed_in("ines_web")
    answer = send(browser, photo(turned=True), f"{PATH}?caption=crown%20%E2%80%93%20wet")
    assert answer.status_code == 201, answer.text
    (listed,) = answer.json()["photos"]
    assert (listed["caption"], listed["added_by"], listed["stored"]) == ("crown – wet", "ines_web", True)
    shown = signed_in("viola_web").get(f"/photos/{listed['id']}")
    assert shown.status_code == 200
    assert hashlib.sha256(shown.content).hexdigest() + ".jpg" == listed["path"]
    assert rows(conn) == [(1, listed["path"], "crown – wet", "ines_web")]
    image = opened(shown.content)
    assert (image.format, image.size) == ("JPEG", (300, 400))
    assert near(image.getpixel((150, 100)), RED)
    assert near(image.getpixel((150, 300)), BLUE)
    exif = image.getexif()
    assert dict(exif.get_ifd(0x8769)) == {0x9003: TAKEN}
    assert set(exif) == {0x8769}
    assert SERIAL.encode() not in shown.content
    assert b"Maker" not in shown.content
    assert (files(conn), [path.name for path in tmp_path.iterdir()]) == (
        (1, []) if place == "database" else (0, [listed["path"]])
    )


def test_headers_of_a_photo(signed_in: SignIn) -> None:
    browser = signed_in("ines_web")
    path = f"/photos/{sent(browser, photo())['id']}"
    answer = browser.get(path)
    expected = {
        "content-type": "image/jpeg", "x-content-type-options": "nosniff", "content-disposition": "inline",
        "content-security-policy": "default-src 'none'; sandbox", "cache-control": "private, no-cache",
    }  # fmt: skip
    assert expected.items() <= dict(answer.headers).items()
    again = browser.get(path, headers={"If-None-Match": answer.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    small = browser.get(f"{path}?size=small", headers={"If-None-Match": answer.headers["etag"]})
    assert max(opened(small.content).size) <= 480
    browser.cookies.clear()
    assert browser.get(path).status_code == 401


@pytest.mark.parametrize("kind", ["PNG", "WEBP"])
def test_png_and_webp_become_jpeg(signed_in: SignIn, kind: str) -> None:
    browser = signed_in("ines_web")
    content = browser.get(f"/photos/{sent(browser, photo(kind))['id']}").content
    assert opened(content).format == "JPEG"
    assert near(opened(content).getpixel((100, 200)), RED)
    assert SERIAL.encode() not in content


@pytest.mark.parametrize("kind", ["PNG", "WEBP", "MPO"])
def test_of_several_pictures_the_first_is_stored(signed_in: SignIn, kind: str) -> None:
    out = io.BytesIO()
    Image.new("RGB", (80, 60), RED).save(out, kind, save_all=True, append_images=[Image.new("RGB", (80, 60), BLUE)])
    browser = signed_in("ines_web")
    content = browser.get(f"/photos/{sent(browser, out.getvalue())['id']}").content
    assert near(opened(content).getpixel((40, 30)), RED)


def test_colours_are_those_of_the_profile(signed_in: SignIn) -> None:
    """A profile of a display whose red is blue, and the reverse."""
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    swapped = profile.replace(b"rXYZ", b"????", 1).replace(b"bXYZ", b"rXYZ", 1).replace(b"????", b"bXYZ", 1)
    out = io.BytesIO()
    Image.new("RGB", (80, 60), RED).save(out, "JPEG", icc_profile=swapped)
    browser = signed_in("ines_web")
    content = browser.get(f"/photos/{sent(browser, out.getvalue())['id']}").content
    assert near(opened(content).getpixel((40, 30)), BLUE)
    assert "icc_profile" not in opened(content).info


def test_a_large_photo_is_stored_smaller(signed_in: SignIn) -> None:
    browser = signed_in("ines_web")
    image = opened(browser.get(f"/photos/{sent(browser, photo(size=(8000, 6000)))['id']}").content)
    assert image.size == (4000, 3000)


def test_the_same_photo_is_stored_once(place: str, signed_in: SignIn, conn: psycopg.Connection, tmp_path: Path) -> None:
    ines, ivo = signed_in("ines_web"), signed_in("ivo_web")
    first = sent(ines, photo())
    assert sent(ines, photo()) == first
    second = sent(ivo, photo() + b"another end", "/api/findings/2/photos")
    assert second["path"] == first["path"]
    assert [row[0] for row in rows(conn)] == [1, 2]
    assert files(conn) + len(list(tmp_path.iterdir())) == 1
    assert ines.delete(f"{PATH}/{first['id']}").json()["photos"] == []
    assert ivo.get(f"/photos/{second['id']}").status_code == 200


def test_caption_and_deletion(signed_in: SignIn, conn: psycopg.Connection) -> None:
    browser = signed_in("ines_web")
    one = sent(browser, photo())
    path = f"{PATH}/{one['id']}"
    assert browser.patch(path, json={"caption": " crown "}).json()["photos"][0]["caption"] == "crown"
    assert browser.patch(path, json={"caption": None}).json()["photos"][0]["caption"] is None
    for body in ({"caption": 5}, {"path": "x"}, [], {"caption": "x" * 1001}, {"caption": "a\x00"}):
        assert browser.patch(path, json=body).status_code == 400
    other = f"/api/findings/2/photos/{one['id']}"
    assert browser.patch(other, json={"caption": "x"}).status_code == 404
    assert browser.delete(other).status_code == 404
    assert browser.delete(path).status_code == 200
    assert (browser.delete(path).status_code, browser.get(f"/photos/{one['id']}").status_code) == (404, 404)
    actions = conn.execute("SELECT who, action FROM tunnel_api.audit WHERE view = 'photo' ORDER BY id").fetchall()
    assert actions == [("ines_web", what) for what in ("insert", "update", "update", "delete")]


def test_a_viewer_looks_and_changes_nothing(place: str, signed_in: SignIn, conn: psycopg.Connection, tmp_path: Path) -> None:
    one = sent(signed_in("ines_web"), photo())
    before = rows(conn)
    viola = signed_in("viola_web")
    assert viola.get(f"/photos/{one['id']}").status_code == 200
    for answer in (
        send(viola, photo(seed=9)),
        viola.patch(f"{PATH}/{one['id']}", json={"caption": "x"}),
        viola.delete(f"{PATH}/{one['id']}"),
    ):
        assert answer.status_code == 403
        assert "no right" in answer.json()["error"]
    assert rows(conn) == before
    assert files(conn) + len(list(tmp_path.iterdir())) == 1


def test_requests_of_other_pages_are_refused(signed_in: SignIn, conn: psycopg.Connection) -> None:
    browser = signed_in("ines_web")
    for headers in ({"Origin": "http://evil.example.org"}, {"X-CSRF-Token": "guess"}):
        assert browser.post(PATH, content=photo(), headers=headers).status_code == 403
    browser.cookies.clear()
    assert send(browser, photo()).status_code == 401
    assert rows(conn) == []


HEIC = b"\0\0\0\x18ftypheic\0\0\0\0mif1heic" + bytes(100)

REFUSED = {
    "empty": (b"", "damaged"),
    "text": (b"GIF89a no, this is text", "not a JPEG, PNG or WebP picture"),
    "SVG": (b"<svg xmlns='http://www.w3.org/2000/svg'><script>alert(1)</script></svg>", "not a JPEG, PNG or WebP picture"),
    "HTML": (b"<!doctype html><script>alert(1)</script>", "not a JPEG, PNG or WebP picture"),
    "HEIC": (HEIC, "HEIC and AVIF are not supported: set the camera to JPEG"),
    "video": (b"\0\0\0\x18ftypmp42" + bytes(100), "not a JPEG, PNG or WebP picture"),
    "cut JPEG": (photo()[:-200], "damaged"),
    "head of a JPEG": (photo()[:300], "damaged"),
    "cut PNG": (photo("PNG")[:-200], "damaged"),
    "cut WebP": (photo("WEBP")[:-100], "damaged"),
    "3600 megapixels": (bomb(60_000, 60_000), "more than 50 megapixels"),
    "60 megapixels": (bomb(10_000, 6_000), "more than 50 megapixels"),
    "900 MB of text": (bomb(80, 60, text=900_000_000), "damaged"),
    "GIF": (b"GIF89a\x01\0\x01\0\0\0\0;", "not a JPEG, PNG or WebP picture"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_photo_is_refused_in_one_line(
    name: str, desk: Desk, signed_in: SignIn, conn: psycopg.Connection, tmp_path: Path
) -> None:
    desk.photos = tmp_path
    content, why = REFUSED[name]
    answer = send(signed_in("ines_web"), content)
    assert answer.status_code == 400
    assert why in answer.json()["error"]
    assert "\n" not in answer.json()["error"]
    assert (rows(conn), list(tmp_path.iterdir())) == ([], [])


def test_an_uploaded_bomb_within_the_limit_is_small(signed_in: SignIn) -> None:
    """49 megapixels of white take 62 kB."""
    browser = signed_in("ines_web")
    assert len(bomb(7000, 7000)) < 70_000
    assert opened(browser.get(f"/photos/{sent(browser, bomb(7000, 7000))['id']}").content).size == (4000, 4000)


def test_a_polyglot_is_only_an_image(signed_in: SignIn) -> None:
    browser = signed_in("ines_web")
    script = b"<html><script>alert(document.domain)</script></html>"
    picture = photo()
    comment = picture[:2] + b"\xff\xfe" + (len(script) + 2).to_bytes(2, "big") + script + picture[2:]
    answer = browser.get(f"/photos/{sent(browser, comment + script)['id']}")
    assert (answer.headers["content-type"], answer.headers["x-content-type-options"]) == ("image/jpeg", "nosniff")
    assert b"script" not in answer.content


def test_bytes_that_an_inspector_forges_by_sql_are_no_page(signed_in: SignIn, conn: psycopg.Connection) -> None:
    """The function of the database takes what begins as a JPEG: no script in it ever runs."""
    forged = b"\xff\xd8\xff<html><script>alert(1)</script>"
    (key,) = conn.execute("SELECT tunnel_api.finding_photo_add(1, %b, NULL)", [forged]).fetchone()  # type: ignore[misc]
    conn.commit()
    browser = signed_in("viola_web")
    answer = browser.get(f"/photos/{key}")
    assert (answer.headers["content-type"], answer.headers["x-content-type-options"]) == ("image/jpeg", "nosniff")
    assert "sandbox" in answer.headers["content-security-policy"]
    assert browser.get(f"/photos/{key}?size=small").status_code == 400
    for content in (b"<html>", b"", None):
        with pytest.raises(psycopg.errors.InvalidParameterValue, match="a photo is a JPEG of at most"):
            conn.execute("SELECT tunnel_api.finding_photo_add(1, %b, NULL)", [content])
        conn.rollback()


def test_no_other_file_of_the_server_is_shown(desk: Desk, signed_in: SignIn, conn: psycopg.Connection, tmp_path: Path) -> None:
    folder, outside = tmp_path / "photos", tmp_path / "secret.jpg"
    folder.mkdir()
    desk.photos = folder
    outside.write_bytes(photo())
    (folder / "named.jpg").write_bytes(photo())
    link, page, gone = ("0" * 64 + ".jpg", "1" * 64 + ".jpg", "2" * 64 + ".jpg")
    (folder / link).symlink_to(outside)
    (folder / page).write_text("<html>")
    browser = signed_in("viola_web")
    for path in ("../secret.jpg", str(outside), "named.jpg", "https://example.org/a.jpg", link, page, gone, f"x/../{link}"):
        row = conn.execute(
            "INSERT INTO tunnel_api.finding_photo (finding_id, path) VALUES (1, %s) RETURNING id", [path]
        ).fetchone()
        assert row is not None
        conn.commit()
        for size in ("", "?size=small"):
            answer = browser.get(f"/photos/{row[0]}{size}")
            assert (answer.status_code, answer.json()) == (404, {"error": f"photo {row[0]} is not here"}), path
    assert browser.get("/photos/..%2f..%2fetc%2fpasswd").status_code == 404
    assert browser.get("/photos/999999").status_code == 404


@pytest.mark.parametrize("size", ["", "?size=small"])
def test_a_row_that_changes_while_its_photo_is_read_shows_no_other(
    signed_in: SignIn, conn: psycopg.Connection, monkeypatch: pytest.MonkeyPatch, size: str
) -> None:
    """Or the small picture of one photo would be kept under the name of the other, for all people."""
    browser = signed_in("ines_web")
    first, second = sent(browser, photo(seed=1)), sent(browser, photo(seed=2), "/api/findings/2/photos")
    name_of = photos.name_of

    def slow(call: Any) -> str:
        name = name_of(call)
        conn.execute("UPDATE tunnel_api.finding_photo SET path = %s WHERE id = %s", [second["path"], first["id"]])
        conn.commit()
        return name

    expected = browser.get(f"/photos/{second['id']}{size}").content
    monkeypatch.setattr(photos, "name_of", slow)
    assert browser.get(f"/photos/{first['id']}{size}").status_code == 404
    monkeypatch.undo()
    assert browser.get(f"/photos/{first['id']}{size}").content == expected


def test_only_photos_may_be_long(signed_in: SignIn) -> None:
    browser = signed_in("ines_web")
    assert send(browser, bytes(MAX_PHOTO + 1)).status_code == 413
    assert browser.post("/api/findings/merge", content=bytes(MAX_BODY + 1)).status_code == 413
    assert browser.patch(f"{PATH}/1", content=bytes(MAX_BODY + 1)).status_code == 413
    noise = photo() + os.urandom(MAX_BODY)
    assert send(browser, noise).status_code == 201


def test_no_finding_no_photo(place: str, signed_in: SignIn, conn: psycopg.Connection, tmp_path: Path) -> None:
    browser = signed_in("ines_web")
    for key in (0, 999_999, 10**18 - 1):
        assert send(browser, photo(), f"/api/findings/{key}/photos").status_code == 404
    assert files(conn) + len(list(tmp_path.iterdir())) == 0


def test_more_than_a_hundred_photos_are_refused(signed_in: SignIn, conn: psycopg.Connection) -> None:
    conn.execute("INSERT INTO tunnel_api.finding_photo (finding_id, path) SELECT 1, n || '.jpg' FROM generate_series(1, 100) n")
    conn.commit()
    answer = send(signed_in("ines_web"), photo())
    assert (answer.status_code, "100 photos" in answer.json()["error"]) == (400, True)
    assert files(conn) == 0


def test_a_full_disk_is_one_line_and_leaves_nothing(
    desk: Desk, signed_in: SignIn, conn: psycopg.Connection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    desk.photos = tmp_path
    browser = signed_in("ines_web")
    monkeypatch.setattr(os, "fsync", full)
    answer = send(browser, photo())
    assert (answer.status_code, "nothing was saved" in answer.json()["error"]) == (503, True)
    assert (rows(conn), list(tmp_path.iterdir())) == ([], [])


def test_a_deleted_finding_comes_back_with_its_photo(place: str, signed_in: SignIn) -> None:
    browser = signed_in("ines_web")
    body = {"geometry": POLYGON, "kind": "spall", "severity": 2, "width_mm": None, "remark": None}
    key = browser.post("/api/surveys/demo-2024/findings", json=body).json()["id"]
    one = sent(browser, photo(), f"/api/findings/{key}/photos")
    content = browser.get(f"/photos/{one['id']}").content
    assert browser.delete(f"/api/findings/{key}").status_code == 204
    assert browser.get(f"/photos/{one['id']}").status_code == 404
    (again,) = browser.post(f"/api/findings/{key}/undo").json()["finding"]["photos"]
    assert again["path"] == one["path"]
    assert browser.get(f"/photos/{again['id']}").content == content


def test_an_operator_removes_files_that_no_finding_shows(signed_in: SignIn, conn: psycopg.Connection) -> None:
    """By the statement of the documentation."""
    browser = signed_in("ines_web")
    kept, gone = (sent(browser, photo(seed=n)) for n in (1, 2))
    browser.delete(f"{PATH}/{gone['id']}")
    assert files(conn) == 2
    page = (Path(__file__).parents[2] / "docs" / "howto-desk.md").read_text()
    (statement,) = re.findall(r"^```psql\n(DELETE FROM tunnel\.photo_file.*?)^```$", page, re.MULTILINE | re.DOTALL)
    conn.execute("SET ROLE tunnel_operator")
    assert conn.execute(statement.encode()).rowcount == 1
    conn.commit()
    assert browser.get(f"/photos/{kept['id']}").status_code == 200


def test_the_report_shows_uploaded_photos(place: str, signed_in: SignIn, conn: psycopg.Connection) -> None:
    one = sent(signed_in("ines_web"), photo(turned=True))
    conn.execute("INSERT INTO tunnel_api.finding_photo (finding_id, path) VALUES (1, 'elsewhere.jpg')")
    conn.commit()
    answer = signed_in("olga_web").get("/api/surveys/demo-2024/export?what=report")
    assert answer.status_code == 200, answer.text
    (url,) = re.findall(r'<figure><img src="data:image/jpeg;base64,([^"]+)"', answer.text)
    image = opened(base64.b64decode(url))
    assert near(image.getpixel((image.width // 2, image.height // 4)), RED)
    assert "Photo elsewhere.jpg" in answer.text
    assert f"Photo {one['path']}" not in answer.text
