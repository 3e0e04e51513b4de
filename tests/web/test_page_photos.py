"""Photos in Chromium: added by the file chooser and by touch, enlarged, captioned, deleted."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import psycopg
import pytest
from playwright.sync_api import BrowserContext, FilePayload, Locator, Page, expect
from support.desk_page import accessibility_findings, forgive, opened
from support.example_survey import NAME
from support.photo_files import RED, near, photo
from support.photo_files import opened as picture
from web.test_page_narrow import PHONE, overflows

SHOWN = f"/#/{NAME}/finding/1"


def files(*seeds: int) -> list[FilePayload]:
    return [{"name": f"IMG_{n}.jpg", "mimeType": "image/jpeg", "buffer": photo(turned=True, seed=n)} for n in seeds]


@pytest.fixture(autouse=True)
def no_photos(database: psycopg.Connection) -> None:
    """Forget the photos of other tests."""
    database.execute("DELETE FROM tunnel.photo")


@pytest.fixture
def shown(ines_context: BrowserContext, database: psycopg.Connection) -> Iterator[Page]:
    """Page of a finding at the desk of an inspector."""
    with opened(ines_context, SHOWN) as page:
        expect(page.locator(".finding-head")).to_contain_text("no. 1")
        yield page


def rows(database: psycopg.Connection) -> list[tuple[str | None, str]]:
    return database.execute(
        "SELECT caption, added_by FROM tunnel_api.finding_photo WHERE finding_id = 1 ORDER BY id"
    ).fetchall()


def choose(page: Page, button: str, payload: Sequence[FilePayload] | Sequence[Path]) -> None:
    """Give files to the chooser that a button opens."""
    with page.expect_file_chooser() as chooser:
        page.locator(".photos").get_by_role("button", name=button).click()
    chooser.value.set_files(payload)


def loaded(image: Locator) -> None:
    """Wait until a picture is there."""
    image.scroll_into_view_if_needed()
    expect(image).to_have_js_property("complete", value=True)
    assert image.evaluate("(node) => node.naturalWidth > 0")


def test_several_photos_are_added_enlarged_captioned_and_deleted(shown: Page, database: psycopg.Connection) -> None:
    page = shown
    choose(page, "Add photos", files(1, 2))
    expect(page.locator(".thumb")).to_have_count(2)
    expect(page.locator("#state")).to_have_text("Saved. Photo of finding 1.")
    expect(page.locator(".photos h3")).to_have_text("Photos (2)")
    expect(page.locator(".photos .upload")).to_have_count(0)
    assert rows(database) == [(None, "ines_web")] * 2
    for n in range(2):
        loaded(page.locator(".thumb img").nth(n))
    page.locator(".thumb").first.click()
    dialog = page.locator("dialog.photo")
    loaded(dialog.locator("img"))
    size = dialog.locator("img").evaluate("(node) => [node.naturalWidth, node.naturalHeight]")
    assert size == [300, 400]
    expect(dialog).to_contain_text("ines_web")
    assert accessibility_findings(page) == []
    dialog.get_by_label("Caption").fill("crown, c r n")
    dialog.get_by_role("button", name="Save caption").click()
    expect(dialog).to_have_count(0)
    expect(page.locator(".thumb").first).to_contain_text("crown, c r n")
    assert rows(database)[0] == ("crown, c r n", "ines_web")
    assert database.execute("SELECT review FROM tunnel_api.finding WHERE id = 1").fetchone() == ("open",)
    page.locator(".thumb").first.click()
    dialog.get_by_role("button", name="Delete photo").click()
    dialog.get_by_role("button", name="Keep").click()
    assert len(rows(database)) == 2
    dialog.get_by_role("button", name="Delete photo").click()
    dialog.get_by_role("button", name="Delete", exact=True).click()
    expect(page.locator(".thumb")).to_have_count(1)
    assert rows(database) == [(None, "ines_web")]
    page.reload()
    expect(page.locator(".thumb")).to_have_count(1)


def test_a_photo_is_not_saved_until_the_server_has_it(shown: Page, database: psycopg.Connection) -> None:
    """Without a network the photo waits, also at another finding; it is sent to its own finding once the network is back."""
    page = shown
    page.context.set_offline(True)
    try:
        choose(page, "Add photos", files(3))
        expect(page.locator(".upload")).to_contain_text("IMG_3.jpg: recorded on this device, not in the database yet")
        expect(page.locator("#state")).to_have_text("Recorded on this device. Photo of finding 1.")
        assert rows(database) == []
    finally:
        page.context.set_offline(False)
    expect(page.locator(".thumb")).to_have_count(1)
    assert rows(database) == [(None, "ines_web")]
    forgive(page, "ERR_INTERNET_DISCONNECTED")


def test_a_failed_read_does_not_hide_what_became_of_a_record(
    ines_context: BrowserContext, database: psycopg.Connection
) -> None:
    """The inspected share cannot be read: that stands in its own place."""
    ines_context.route("**/summary", lambda route: route.abort())
    with opened(ines_context, SHOWN) as page:
        expect(page.locator("#limits")).to_contain_text("Inspected share: not known. The server cannot be reached.")
        expect(page.locator("#state")).to_be_empty()
        forgive(page, "ERR_FAILED")
    ines_context.unroute("**/summary")


def test_what_is_no_photo_is_said_in_one_line(shown: Page, database: psycopg.Connection, tmp_path: Path) -> None:
    page = shown
    page_file: FilePayload = {"name": "evil.jpg", "mimeType": "image/jpeg", "buffer": b"<script>alert(1)</script>"}
    choose(page, "Add photos", [page_file, *files(4)])
    expect(page.locator(".thumb")).to_have_count(1)
    line = page.locator(".upload")
    expect(line).to_contain_text("evil.jpg: not saved: the photo is not a JPEG, PNG or WebP picture")
    line.get_by_role("button", name="Discard").click()
    expect(line).to_have_count(0)
    large = tmp_path / "large.jpg"
    large.write_bytes(bytes(26_000_000))
    choose(page, "Add photos", [large])
    expect(line).to_contain_text("large.jpg: not saved: it has 26 MB; a photo has at most 25 MB")
    line.get_by_role("button", name="Discard").click()
    assert len(rows(database)) == 1
    forgive(page, "400")


def test_a_phone_adds_a_photo_by_touch(context_of: Callable[..., BrowserContext], database: psycopg.Connection) -> None:
    with opened(context_of("ines_web", **PHONE), SHOWN) as page:
        for name in ("Add photos", "Take photo"):
            control = page.locator(".photos").get_by_role("button", name=name)
            control.scroll_into_view_if_needed()
            box = control.bounding_box()
            assert box is not None
            assert box["height"] >= 44
        camera = page.locator(".photos .camera input")
        assert camera.get_attribute("capture") == "environment"
        with page.expect_file_chooser() as chooser:
            page.locator(".photos").get_by_role("button", name="Take photo").tap()
        assert not chooser.value.is_multiple()
        chooser.value.set_files(files(5))
        expect(page.locator("#state")).to_have_text("Saved. Photo of finding 1.")
        loaded(page.locator(".thumb img"))
        page.locator(".thumb").tap()
        loaded(page.locator("dialog.photo img"))
        assert not overflows(page)
        box = page.locator("dialog.photo").bounding_box()
        assert box is not None
        assert (box["x"] >= 0, box["x"] + box["width"] <= 390) == (True, True)
        page.locator("dialog.photo").get_by_role("button", name="Close").tap()
    assert rows(database) == [(None, "ines_web")]


def test_a_viewer_sees_photos_and_no_buttons(
    shown: Page, context_of: Callable[..., BrowserContext], database: psycopg.Connection
) -> None:
    choose(shown, "Add photos", files(6))
    expect(shown.locator(".thumb")).to_have_count(1)
    database.execute("INSERT INTO tunnel_api.finding_photo (finding_id, path, caption) VALUES (1, 'dir/a.jpg', '<b>wet</b>')")
    with opened(context_of("viola_web"), SHOWN) as page:
        loaded(page.locator(".thumb img"))
        expect(page.locator(".photos .plain").first).to_have_text("dir/a.jpg <b>wet</b>")
        assert page.locator(".photos").get_by_role("button", name=re.compile("photo", re.I)).all_inner_texts() == [""]
        page.locator(".thumb").click()
        assert page.locator("dialog.photo button").all_inner_texts() == ["Close"]
        content = page.context.request.get(page.locator("dialog.photo img").evaluate("(node) => node.src")).body()
        assert near(picture(content).getpixel((150, 120)), RED)
        page.keyboard.press("Escape")
        page.goto(f"/#/{NAME}/finding/2")
        expect(page.locator(".finding-head")).to_contain_text("no. 2")
        expect(page.locator(".photos")).to_be_hidden()
