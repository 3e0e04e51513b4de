"""The page of the desk in Chromium: sign in, open it, and see that nothing went wrong."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import BrowserContext, Locator, Page, expect

DESKTOP = {"width": 1440, "height": 900}

PATIENCE = 30_000
"""Longest wait for anything on the page, ms."""

expect.set_options(timeout=PATIENCE)

AXE = Axe()

_troubles: dict[Page, list[str]] = {}


def token_of(form: str) -> str:
    """Return the token against forged requests of a form."""
    return form.partition('name="csrf" value="')[2].partition('"')[0]


def enter(context: BrowserContext, user: str, password: str) -> None:
    """Sign in with what the form would send, without a page."""
    context.set_default_timeout(PATIENCE)
    token = token_of(context.request.get("/login").text())
    answer = context.request.post("/login", form={"user": user, "password": password, "csrf": token})
    assert answer.ok, answer.text()
    assert not answer.url.endswith("/login")


def sign_in(page: Page, user: str, password: str) -> None:
    """Fill in the form that is shown."""
    page.get_by_label("User").fill(user)
    page.get_by_label("Password").fill(password)
    page.get_by_role("button", name="Sign in").click()


@contextmanager
def opened(context: BrowserContext, address: str) -> Iterator[Page]:
    """Page at an address; at its end no error was in the console, no script failed, and the policy was not violated."""
    page = context.new_page()
    troubles = _troubles[page] = []
    page.on("console", lambda message: message.type == "error" and troubles.append(message.text))
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.add_init_script(
        "document.addEventListener('securitypolicyviolation', (event) => console.error(`CSP: ${event.violatedDirective}`))"
    )
    try:
        page.goto(address)
        ready(page)
        yield page
        assert not troubles, "\n".join(troubles)
    finally:
        del _troubles[page]
        page.close()


def ready(page: Page) -> None:
    """Wait until the page has read its survey, or the table of surveys."""
    expect(page.locator("#desk:not([hidden]) .ol-layer canvas, #surveys:not([hidden]) tbody, .card").first).to_be_attached()


def forgive(page: Page, pattern: str) -> None:
    """Drop the messages of the browser on requests that failed, as the test wants them to."""
    wanted = [text for text in _troubles[page] if re.search(pattern, text)]
    assert wanted, f"no message has {pattern}"
    _troubles[page][:] = [text for text in _troubles[page] if text not in wanted]


def tab(page: Page, name: str) -> Locator:
    """Choose a tab of the panel; return the panel."""
    page.get_by_role("tab", name=name).click()
    return page.locator("#panel-body")


def at(page: Page, x: float, y: float) -> tuple[float, float]:
    """Return where a place of the lining (chainage, arc; m) is on the page, from the position in the address."""
    view = position(page)
    box = page.locator("#map").bounding_box()
    assert box is not None
    pixel = 156543.03392804097 / 2 ** view["z"]
    return box["x"] + box["width"] / 2 + (x - view["x"]) / pixel, box["y"] + box["height"] / 2 - (y - view["y"]) / pixel


def position(page: Page) -> dict[str, float]:
    """Return the view that the address states: x, y, z."""
    expect(page).to_have_url(re.compile(r"[?&]z="))
    return {name: float(value) for name, value in re.findall(r"[?&]([xyz])=(-?[\d.]+)", page.url)}


def settled(page: Page) -> dict[str, float]:
    """Return the view, once it no longer moves: an animation lasts 0.25 s, and the address follows within 0.3 s."""
    before = None
    page.wait_for_timeout(300)
    while (view := position(page)) != before:
        before = view
        page.wait_for_timeout(200)
    return view


def comes_to(page: Page, fits: Callable[[dict[str, float]], object]) -> dict[str, float]:
    """Wait until the view fits; return it."""
    for _ in range(PATIENCE // 100):
        if fits(view := position(page)):
            return view
        page.wait_for_timeout(100)
    raise AssertionError(f"the view stays at {view}")


def accessibility_findings(page: Page) -> list[str]:
    """Return the serious and critical findings of axe."""
    if not page.evaluate("'axe' in window"):
        page.evaluate(AXE.axe_script)
    found = page.evaluate("axe.run(document, { resultTypes: ['violations'] }).then(({ violations }) => violations)")
    return [
        f"{one['id']}: {one['help']}: {[node['target'] for node in one['nodes']][:3]}"
        for one in found
        if one["impact"] in ("serious", "critical")
    ]
