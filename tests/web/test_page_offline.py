"""The desk without a network, in Chromium: what was taken offline is shown, and what is recorded arrives once."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any

import psycopg
import pytest
from playwright.sync_api import Browser, BrowserContext, Page, Route, expect
from support.desk_page import DESKTOP, accessibility_findings, at, enter, forgive, opened, settled, sign_in, tab
from support.desk_server import DeskServer
from support.example_survey import NAME
from support.photo_files import photo
from web.conftest import PASSWORD
from web.test_page_narrow import PHONE, overflows

STRETCH = "12+300", "12+360"
SHORT = "12+315", "12+320"
"""Holds finding 1, in a fifth of the tiles of STRETCH."""

VIEW = f"/#/{NAME}?x=12330&y=0&z=20"

QUIET = "ERR_INTERNET_DISCONNECTED|ERR_FAILED|ERR_CONNECTION|status of 503|status of 401|status of 409"
"""Messages of a browser without a network, and of refusals."""

Tablets = Callable[..., BrowserContext]


@pytest.fixture
def tablets(chrome: Browser, server: DeskServer, database: psycopg.Connection) -> Iterator[Tablets]:
    """Return a function that returns a browser of its own, in which somebody is signed in."""
    database.execute("DELETE FROM tunnel.photo")
    made: list[BrowserContext] = []

    def make(user: str = "ines_web", **settings: Any) -> BrowserContext:
        context = chrome.new_context(base_url=server.address, **{"viewport": DESKTOP, **settings})
        made.append(context)
        enter(context, user, PASSWORD)
        return context

    yield make
    for context in made:
        context.close()


def take(page: Page, stretch: tuple[str, str] = STRETCH) -> None:
    """Take a stretch offline."""
    panel = measured(page, stretch)
    panel.get_by_role("button", name="Take offline").click()
    expect(panel.get_by_role("status")).to_contain_text(f"Taken offline: {NAME}")


def measured(page: Page, stretch: tuple[str, str] = STRETCH) -> Any:
    """Fill in a stretch, and ask for its size; return the panel."""
    panel = tab(page, "Offline")
    panel.get_by_label("From", exact=True).fill(stretch[0])
    panel.get_by_label("To", exact=True).fill(stretch[1])
    panel.get_by_role("button", name="State size").click()
    expect(panel.get_by_role("status")).to_contain_text("tiles of images")
    return panel


def reviews(database: psycopg.Connection, *keys: int) -> list[tuple[Any, ...]]:
    return database.execute(
        "SELECT id, review, remark, reviewed_by FROM tunnel_api.finding WHERE id = ANY(%s) ORDER BY id", [list(keys)]
    ).fetchall()


def drawn(database: psycopg.Connection) -> list[tuple[Any, ...]]:
    return database.execute("SELECT id, kind, remark, drawn_by FROM tunnel_api.finding WHERE manual ORDER BY id").fetchall()


def shows(page: Page, text: str) -> None:
    expect(page.locator(".finding-head")).to_contain_text(re.compile(text))
    expect(page.locator(".review:not([aria-busy])")).to_be_attached()


def waits(page: Page, count: int) -> None:
    expect(page.locator("#alerts")).to_contain_text(f"Recorded on this device, not in the database yet: {count}.")


def draw_polygon(page: Page, remark: str) -> None:
    """Draw a square around 12+350, 2 m right of the crown."""
    page.goto(f"/#/{NAME}?x=12350&y=2&z=22&tab=draw")
    settled(page)
    tab(page, "Draw").get_by_role("button", name="Polygon").click()
    form = page.locator(".draw .form")
    form.get_by_label("Kind").select_option("spall")
    form.get_by_label("Remark").fill(remark)
    *corners, last = [at(page, 12350 + x, 2 + y) for x, y in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))]
    for corner in corners:
        page.mouse.click(*corner)
    page.mouse.dblclick(*last)
    expect(page.locator(".draw")).to_contain_text("m²), then save.")
    page.locator(".draw").get_by_role("button", name="Save").click()


def add_photo(page: Page, name: str, seed: int) -> None:
    with page.expect_file_chooser() as chooser:
        page.locator(".photos").get_by_role("button", name="Add photos").click()
    chooser.value.set_files({"name": name, "mimeType": "image/jpeg", "buffer": photo(seed=seed)})


def test_a_shift_without_a_network(tablets: Tablets, database: psycopg.Connection, server: DeskServer) -> None:
    """Verdicts, a remark, a drawing with its photo; over a reload, a closed page and a restart of the server."""
    tablet = tablets()
    with opened(tablet, VIEW) as page:
        take(page)
        expect(tab(page, "Offline")).to_contain_text(re.compile(rf"{NAME}, 12\+300.0 to 12\+360.0: .* MB, as of 20"))
        assert accessibility_findings(page) == []
        tablet.set_offline(True)
        page.reload()
        expect(page.locator("#network")).to_contain_text(re.compile(r"Offline: as of 20\d\d-\d\d-\d\d \d\d:\d\d\."))
        expect(page.locator("#network")).to_contain_text("Elsewhere: not taken offline.")
        expect(page.locator("#limits")).to_contain_text("Inspected: 95.0")
        tab(page, "Review")
        expect(page.locator(".pace")).to_contain_text("0 of 2 reviewed")
        shows(page, "no. 1$")
        page.keyboard.press("c")
        shows(page, "no. 2$")
        waits(page, 1)
        page.locator(".verdicts").get_by_role("button", name="Reject").click()
        waits(page, 2)
        page.keyboard.press("m")
        page.keyboard.type("dry in May")
        page.keyboard.press("Enter")
        waits(page, 3)
        draw_polygon(page, "edge of the niche")
        waits(page, 4)
        expect(page.locator(".draw")).to_contain_text("Shown: a drawing that is not in the database yet.")
        tab(page, "Finding")
        add_photo(page, "IMG_1.jpg", 1)
        expect(page.locator(".upload")).to_contain_text("IMG_1.jpg: recorded on this device, not in the database yet")
        waits(page, 5)
        page.keyboard.press("m")
        page.keyboard.type("niche, 2 cm deep")
        page.keyboard.press("Enter")
        waits(page, 6)
        forgive(page, QUIET)
    assert [review for _, review, _, _ in reviews(database, 1, 2)] == ["open", "open"]
    with opened(tablet, f"/#/{NAME}/finding/1") as page:
        shows(page, "confirmed.*no. 1")
        waits(page, 6)
        page.goto(f"/#/{NAME}/finding/7")
        expect(page.locator("#state")).to_contain_text("The server cannot be reached, and this was not taken offline.")
        server.stop()
        server.start()
        tablet.set_offline(False)
        expect(page.get_by_label("Password")).to_be_visible()
        sign_in(page, "ines_web", PASSWORD)
        expect(page.locator("#state")).to_contain_text("Saved.")
        expect(page.locator("#alerts")).to_be_empty()
        expect(page.locator("#network")).to_be_hidden()
        forgive(page, QUIET)
    assert reviews(database, 1, 2) == [(1, "confirmed", None, "ines_web"), (2, "rejected", "dry in May", "ines_web")]
    ((key, *values),) = drawn(database)
    assert values == ["spall", "niche, 2 cm deep", "ines_web"]
    assert database.execute("SELECT finding_id, added_by FROM tunnel_api.finding_photo").fetchall() == [(key, "ines_web")]
    audit = database.execute("SELECT view, action, who FROM tunnel_api.audit ORDER BY id DESC LIMIT 6").fetchall()
    assert sorted(audit) == sorted(
        [("finding", "update", "ines_web")] * 4 + [("finding", "insert", "ines_web"), ("photo", "insert", "ines_web")]
    )


def test_a_phone_records_by_touch(tablets: Tablets, database: psycopg.Connection) -> None:
    phone = tablets(**PHONE)
    with opened(phone, VIEW) as page:
        take(page, SHORT)
        assert not overflows(page)
        phone.set_offline(True)
        page.goto(f"/#/{NAME}/finding/1")
        shows(page, "no. 1")
        page.locator(".verdicts").get_by_role("button", name="Confirm").tap()
        waits(page, 1)
        page.reload()
        shows(page, "confirmed.*no. 1")
        assert not overflows(page)
        page.locator("#alerts summary").tap()
        for control in page.locator("#alerts button").all():
            box = control.bounding_box()
            assert box is not None
            assert box["height"] >= 44
        phone.set_offline(False)
        expect(page.locator("#state")).to_contain_text("reached again")
        expect(page.locator("#alerts")).to_be_empty()
        forgive(page, QUIET)
    assert reviews(database, 1) == [(1, "confirmed", None, "ines_web")]


def test_a_lost_answer_does_not_double(tablets: Tablets, database: psycopg.Connection) -> None:
    """The server writes a drawing, a photo and a verdict; the connection is cut before the answers come."""
    lost: list[str] = []

    def cut(route: Route) -> None:
        if route.request.method == "GET" or route.request.url in lost:
            route.fallback()
            return
        lost.append(route.request.url)
        route.fetch()
        route.abort()

    tablet = tablets()
    with opened(tablet, VIEW) as page:
        page.route(re.compile(r"/api/(surveys/.*/findings|findings/1(/photos)?)$"), cut)
        draw_polygon(page, "once")
        expect(page.locator(".draw")).to_contain_text(re.compile(r"Shown: finding \d+\."))
        page.goto(f"/#/{NAME}/finding/1")
        shows(page, "no. 1$")
        page.keyboard.press("c")
        add_photo(page, "IMG_2.jpg", 2)
        expect(page.locator(".thumb")).to_have_count(1)
        expect(page.locator("#alerts")).to_be_empty()
        assert len(lost) == 3
        forgive(page, QUIET)
    assert [values[1:] for values in drawn(database)] == [("spall", "once", "ines_web")]
    assert database.execute("SELECT count(*) FROM tunnel_api.finding_photo").fetchone() == (1,)
    audit = database.execute(
        "SELECT action FROM tunnel_api.audit WHERE row_id = 1 AND view = 'finding' ORDER BY id DESC"
    ).fetchall()
    assert len(audit) >= 1
    assert reviews(database, 1) == [(1, "confirmed", None, "ines_web")]


@pytest.mark.parametrize(
    ("button", "expected"), [("Keep theirs", ("rejected", "ivo_web")), ("Write mine", ("confirmed", "ines_web"))]
)
def test_another_inspector_was_faster(
    tablets: Tablets, database: psycopg.Connection, button: str, expected: tuple[str, str]
) -> None:
    """Nothing is written over, and nothing is dropped, until the person decides."""
    tablet, other = tablets(), tablets("ivo_web")
    with opened(tablet, f"/#/{NAME}/finding/1") as page:
        take(page, SHORT)
        tablet.set_offline(True)
        tab(page, "Finding")
        page.keyboard.press("c")
        waits(page, 1)
        with opened(other, f"/#/{NAME}/finding/1") as second:
            shows(second, "no. 1$")
            second.keyboard.press("r")
            expect(second.locator("#state")).to_contain_text("Saved.")
        tablet.set_offline(False)
        expect(page.locator("#alerts")).to_contain_text("Your decision is needed: 1.")
        assert reviews(database, 1)[0][1] == "rejected"
        page.reload()
        page.locator("#alerts summary").click()
        expect(page.locator("#alerts")).to_contain_text(
            "In the database: rejected, Leak, no remark, by ivo_web. Yours: review: confirmed."
        )
        page.locator("#alerts").get_by_role("button", name=button).click()
        expect(page.locator("#alerts")).to_be_empty()
        shows(page, f"{expected[0]}.*no. 1")
        forgive(page, QUIET)
    assert reviews(database, 1) == [(1, expected[0], None, expected[1])]


def stored(page: Page) -> list[str]:
    return page.evaluate(
        "(async () => [...await caches.keys(), ...(await navigator.serviceWorker.getRegistrations()).map(() => 'worker')])()"
    )


def test_sign_out_removes_what_is_held(tablets: Tablets) -> None:
    """The page removes unsent records only after the person has confirmed it."""
    tablet = tablets()
    with opened(tablet, f"/#/{NAME}/finding/1") as page:
        take(page, SHORT)
        assert len(stored(page)) == 3
        page.route("**/api/findings/1", lambda route: route.abort() if route.request.method == "PATCH" else route.fallback())
        tab(page, "Finding")
        page.keyboard.press("c")
        waits(page, 1)
        page.get_by_role("button", name="Sign out").click()
        dialog = page.get_by_role("dialog")
        expect(dialog).to_contain_text("Not in the database yet: 1")
        dialog.get_by_role("button", name="Stay").click()
        waits(page, 1)
        page.get_by_role("button", name="Sign out").click()
        dialog.get_by_role("button", name="Sign out and remove").click()
        expect(page.get_by_label("Password")).to_be_visible()
        assert stored(page) == []
        sign_in(page, "ines_web", PASSWORD)
        expect(page.get_by_role("heading", name="Surveys")).to_be_visible()
        page.goto(f"/#/{NAME}/finding/1")
        shows(page, "open.*no. 1")
        expect(page.locator("#alerts")).to_be_empty()
        forgive(page, QUIET)


def test_another_user_of_the_tablet_sees_nothing(tablets: Tablets, database: psycopg.Connection) -> None:
    """The copies go; what the first one recorded waits unseen until they sign in again."""
    tablet = tablets()
    with opened(tablet, f"/#/{NAME}/finding/1") as page:
        take(page, SHORT)
        tablet.route("**/api/findings/1", lambda r: r.abort() if r.request.method == "PATCH" else r.fallback())
        tab(page, "Finding")
        page.keyboard.press("c")
        waits(page, 1)
        page.goto("about:blank")
        tablet.clear_cookies()
        tablet.unroute("**/api/findings/1")
        page.goto("/login")
        sign_in(page, "ivo_web", PASSWORD)
        expect(page.get_by_role("heading", name="Surveys")).to_be_visible()
        expect(page.locator("#alerts")).to_be_empty()
        page.wait_for_function("caches.keys().then((names) => names.length === 0)")
        assert reviews(database, 1)[0][1] == "open"
        tablet.set_offline(True)
        with pytest.raises(Exception, match="ERR_"):
            page.reload()
        tablet.clear_cookies()
        tablet.set_offline(False)
        page.goto(f"/login#/{NAME}")
        sign_in(page, "ines_web", PASSWORD)
        expect(page.locator("#state")).to_contain_text("Saved. Finding 1: confirmed.")
        forgive(page, QUIET)
    assert reviews(database, 1) == [(1, "confirmed", None, "ines_web")]


def test_a_viewer_takes_a_stretch_and_records_nothing(tablets: Tablets) -> None:
    tablet = tablets("viola_web")
    with opened(tablet, f"/#/{NAME}/finding/1") as page:
        take(page, SHORT)
        tablet.set_offline(True)
        page.reload()
        shows(page, "no. 1")
        expect(page.locator(".verdicts").get_by_role("button", name="Confirm")).to_be_disabled()
        page.keyboard.press("c")
        expect(page.locator("#state")).to_contain_text("A viewer cannot review.")
        expect(page.locator("#alerts")).to_be_empty()


def test_a_full_device_is_one_line(tablets: Tablets, server: DeskServer) -> None:
    """A full device keeps a part of the stretch. The person resumes the download when there is space, or removes the part."""
    tablet = tablets()
    with opened(tablet, VIEW) as page:
        take(page, ("12+300", "12+310"))
        tab(page, "Offline").get_by_role("button", name="Remove").click()
        panel = measured(page)
        used = page.evaluate("navigator.storage.estimate().then(({ usage }) => usage)")
        devtools = tablet.new_cdp_session(page)
        devtools.send("Storage.overrideQuotaForOrigin", {"origin": server.address, "quotaSize": used + 200_000})
        panel.get_by_role("button", name="Take offline").click()
        status = panel.get_by_role("status")
        expect(status).to_contain_text("This device has no space left: remove another stretch, or take a shorter one.")
        expect(status).to_contain_text(re.compile(r"\d+ of \d+ parts are held\."))
        page.evaluate("navigator.storage.estimate = async () => ({ quota: 1000, usage: 0 })")
        panel.get_by_role("button", name="State size").click()
        expect(status).to_contain_text("of space left. Take a shorter stretch.")
        devtools.send("Storage.overrideQuotaForOrigin", {"origin": server.address})
        expect(panel).to_contain_text(re.compile(r"as of .*, \d+ of \d+ parts"))
        panel.get_by_role("button", name="Resume").click()
        expect(status).to_contain_text("Taken offline:")
        expect(panel.get_by_role("button", name="Resume")).to_have_count(0)
        panel.get_by_role("button", name="Remove").click()
        expect(panel).to_contain_text("Nothing is held.")


def test_a_download_is_cancelled_and_resumed(tablets: Tablets) -> None:
    tablet = tablets()
    with opened(tablet, VIEW) as page:
        panel = measured(page)
        panel.get_by_role("button", name="Take offline").click()
        panel.get_by_role("button", name="Cancel").click()
        expect(panel.get_by_role("status")).to_contain_text("Stopped.")
        panel.get_by_role("button", name="Resume").click()
        expect(panel.get_by_role("status")).to_contain_text("Taken offline:")


@pytest.mark.parametrize(
    ("stretch", "said"),
    [
        (("12+400", "12+300"), "the smaller one first"),
        (("11+000", "12+300"), "at most 500 m"),
        (("13+000", "13+100"), "The survey reaches"),
    ],
)
def test_wrong_stretches_get_one_line(ines_context: BrowserContext, stretch: tuple[str, str], said: str) -> None:
    with opened(ines_context, VIEW) as page:
        panel = tab(page, "Offline")
        panel.get_by_label("From", exact=True).fill(stretch[0])
        panel.get_by_label("To", exact=True).fill(stretch[1])
        panel.get_by_role("button", name="State size").click()
        expect(panel.get_by_role("status")).to_contain_text(said)
        expect(panel.get_by_role("button", name="Take offline")).to_be_disabled()


def test_what_is_older_than_a_day_is_removed(tablets: Tablets) -> None:
    tablet = tablets()
    with opened(tablet, VIEW) as page:
        take(page, SHORT)
        page.evaluate(
            """async () => {
              const name = (await caches.keys()).find((one) => one.startsWith('tunneldb.stretch.'));
              const [former, now] = [await caches.open(name), name.split('.').at(-1)];
              const old = await caches.open(name.replace(now, now - 25 * 3600 * 1000));
              for (const request of await former.keys()) await old.put(request, await former.match(request));
              await caches.delete(name);
            }"""
        )
        tablet.set_offline(True)
        page.reload()
        expect(page.locator("#network")).to_contain_text("Nothing is held on this device.")
        expect(page.locator("#state")).to_contain_text("this was not taken offline")
        page.wait_for_function("caches.keys().then((names) => names.length === 1)")
        forgive(page, QUIET)


def test_without_https_the_page_says_why(tablets: Tablets) -> None:
    tablet = tablets()
    tablet.add_init_script("Object.defineProperty(window, 'isSecureContext', { value: false })")
    with opened(tablet, VIEW) as page:
        panel = tab(page, "Offline")
        expect(panel).to_contain_text("A browser works without a network only at an address with https, or at localhost.")
        expect(panel.get_by_role("button")).to_have_count(0)
