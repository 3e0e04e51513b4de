"""Ratings and actions in Chromium: the table is that of the database, and what an inspector writes is stored."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any

import psycopg
import pytest
from playwright.sync_api import BrowserContext, Page, expect
from psycopg.rows import dict_row
from support.desk_page import accessibility_findings, comes_to, forgive, opened, settled, tab
from support.example_survey import NAME

LATER = "demo-2026"
PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}

Contexts = Callable[..., BrowserContext]


@pytest.fixture(autouse=True)
def elements(database: psycopg.Connection) -> Iterator[None]:
    """Blocks, of which one is inspected in part and one not at all; no action yet."""
    database.execute("DELETE FROM tunnel.action")
    database.execute(
        "UPDATE tunnel.element SET chainage_from = 12480, chainage_to = 12600 WHERE name = 'block 4';"
        " INSERT INTO tunnel.element (element_set_id, number, name, chainage_from, chainage_to)"
        " SELECT id, 5, 'portal', 12600, 12650 FROM tunnel.element_set WHERE name = 'blocks'"
    )
    yield
    database.execute("DELETE FROM tunnel.element WHERE name = 'portal'")


def rated(database: psycopg.Connection, survey: str = NAME, elements: str = "blocks") -> list[dict[str, Any]]:
    cursor = database.cursor(row_factory=dict_row)
    return cursor.execute("SELECT * FROM tunnel_api.rating(%s, %s, 'example')", [survey, elements]).fetchall()


def stored(database: psycopg.Connection) -> list[dict[str, Any]]:
    return database.cursor(row_factory=dict_row).execute("SELECT * FROM tunnel_api.action ORDER BY id").fetchall()


def add(database: psycopg.Connection, **values: Any) -> int:
    """Add an action by the view."""
    values = {"survey": NAME, "measure": "seal the joint", "finding_id": 1} | values
    (key,) = database.execute(
        f"INSERT INTO tunnel_api.action ({', '.join(values)}) VALUES ({', '.join(['%s'] * len(values))}) RETURNING id",  # type: ignore[arg-type]
        list(values.values()),
    ).fetchone()  # type: ignore[misc]
    return int(key)


def test_the_table_is_that_of_the_database(page: Page, database: psycopg.Connection) -> None:
    """Results in words, counts, order; what was not inspected is never shown as good."""
    panel = tab(page, "Rating")
    rows = panel.locator("tbody tr")
    expect(rows).to_have_count(5)
    expect(panel).to_contain_text("example 1: example of the tests")
    panel.get_by_label("Order").select_option("chainage")
    for number, row in enumerate(rated(database)):
        words = "not rated" if row["result"] is None else row["result"] if row["complete"] else f"at least {row['result']}"
        expect(rows.nth(number).locator(".c0")).to_contain_text(row["name"])
        expect(rows.nth(number).locator(".c1")).to_have_text(words)
        expect(rows.nth(number).locator(".c3")).to_have_text(str(row["findings"]))
        if row["why"]:
            expect(rows.nth(number).locator(".c5")).to_contain_text(row["why"])
    partly, none = rows.nth(3), rows.nth(4)
    expect(partly.locator(".c1")).to_contain_text("at least")
    expect(partly.locator(".swatch.bound")).to_be_visible()
    expect(none.locator(".c1")).to_have_text("not rated")
    expect(none.locator(".c2")).to_have_text("not inspected")
    for row in (partly, none):
        red, green, blue = map(
            int, re.findall(r"\d+", row.locator(".swatch").evaluate("(n) => getComputedStyle(n).backgroundColor"))[:3]
        )
        assert not (green > red + 20 and green > blue + 20), (red, green, blue)
    expect(panel.locator(".totals li").last).to_have_text("not rated: 1")
    panel.get_by_label("Order").select_option("worst")
    worst = max(rated(database), key=lambda row: row["level"] or 0)
    expect(rows.first.locator(".c1")).to_contain_text(worst["result"])
    expect(panel).to_contain_text("There is no earlier inspection of the tunnel.")


def test_an_element_leads_to_its_place_and_its_finding(page: Page, database: psycopg.Connection) -> None:
    panel = tab(page, "Rating")
    panel.get_by_role("button", name="block 2", exact=True).click()
    comes_to(page, lambda view: abs(view["x"] - 12375) < 1)
    (row,) = [row for row in rated(database) if row["name"] == "block 1"]
    panel.get_by_role("link", name=f"finding {row['finding_id']}").first.click()
    expect(page.locator(".finding-head")).to_contain_text(f"no. {row['finding_id']}")
    page.locator("#ribbon canvas").hover(position={"x": 30, "y": 30})
    expect(page.locator(".tip")).to_contain_text("rated at least C" if not row["complete"] else f"rated {row['result']}")


def test_zones_and_a_review_that_changes_the_rating(page: Page, database: psycopg.Connection) -> None:
    panel = tab(page, "Rating")
    panel.get_by_label("Elements").select_option("zones")
    expect(panel.locator("tbody tr")).to_have_count(16)
    expect(panel.locator("tbody")).to_contain_text("10:00 to 2:00 o’clock")
    panel.get_by_label("Elements").select_option("blocks")
    expect(panel.locator("tbody tr")).to_have_count(5)
    database.execute("UPDATE tunnel.finding SET review = 'rejected'")
    tab(page, "Finding")
    tab(page, "Rating")
    assert [row["complete"] for row in rated(database) if row["result"] == "A"] == [False, True, True, False]
    expect(panel.locator(".totals li")).to_have_text(["at least A: 2", "A: 2", "not rated: 1"])


def test_change_since_the_earlier_inspection(ines_context: BrowserContext, database: psycopg.Connection) -> None:
    """The later survey found no leak: what was inspected in full became better, and of the rest nothing is certain."""
    rows = (
        database.cursor(row_factory=dict_row)
        .execute("SELECT * FROM tunnel_api.rating_change(%s, 'blocks', 'example')", [LATER])
        .fetchall()
    )
    with opened(ines_context, f"/#/{LATER}?tab=rating") as page:
        panel = page.locator("#panel-body")
        panel.get_by_label("Order").select_option("chainage")
        expect(panel).to_contain_text(f"Since {NAME} (2024-05-04)")
        for number, row in enumerate(rows):
            words = (
                "not known" if row["change"] is None else "uncertain" if not row["known"]
                else "same" if row["change"] == 0 else f"better by {-row['change']}"
            )  # fmt: skip
            expect(panel.locator("tbody tr").nth(number).locator(".c4")).to_contain_text(words)
        assert {"better by", "uncertain", "not known"} <= {
            word for word in ("better by", "uncertain", "not known") if word in panel.locator("tbody").inner_text()
        }


def test_an_inspector_adds_and_changes_an_action(page: Page, database: psycopg.Connection) -> None:
    """From the panel of the finding to the list, and each value is that of the database."""
    page.goto(f"/#/{NAME}/finding/1")
    panel = page.locator("#panel-body")
    panel.get_by_role("button", name="Add action").click()
    form = panel.get_by_role("form", name="New action")
    form.get_by_role("button", name="Save").click()
    expect(form.get_by_role("alert")).to_contain_text("Enter the measure")
    form.get_by_label("Measure").fill("Inject the joint")
    form.get_by_label("Urgency").select_option("urgent")
    form.get_by_label("Responsible").fill("Works Ltd")
    form.get_by_label("Due").fill("2021-03-31")
    form.get_by_label("Cost").fill("1200,50")
    form.get_by_label("Remark").fill("scaffold needed")
    form.get_by_role("button", name="Save").click()
    card = panel.locator(".action")
    expect(card).to_have_class(re.compile("overdue"))
    expect(card).to_contain_text("Due 2021-03-31; Works Ltd; 1\u202f200.50 EUR")
    expect(card).to_contain_text("not compared")
    (row,) = stored(database)
    assert (row["finding_id"], row["measure"], row["urgency"], str(row["due"])) == (
        1,
        "Inject the joint",
        "urgent",
        "2021-03-31",
    )
    assert (float(row["cost"]), row["currency"], row["remark"], row["added_by"]) == (
        1200.5,
        "EUR",
        "scaffold needed",
        "ines_web",
    )
    card.get_by_role("button", name="Change").click()
    form = panel.get_by_role("form", name=f"Action {row['id']}")
    form.get_by_label("State").select_option("done")
    form.get_by_label("Cost").fill("")
    form.get_by_role("button", name="Save").click()
    expect(panel).to_contain_text("0 of 1 actions; overdue: 0")
    (row,) = stored(database)
    assert (row["state"], row["cost"], row["currency"], row["changed_by"]) == ("done", None, None, "ines_web")
    panel.get_by_label("State").select_option("all")
    tab(page, "Finding")
    expect(panel.locator(".finding-actions")).to_contain_text("Inject the joint")
    expect(panel.locator(".finding-actions")).to_contain_text("done")
    panel.get_by_role("button", name="Inject the joint").click()
    panel.get_by_role("button", name=f"Delete action {row['id']}").click()
    panel.get_by_role("button", name="Delete", exact=True).click()
    expect(panel).to_contain_text("The tunnel has no action.")
    assert stored(database) == []


def test_a_change_of_another_person_is_not_written_over(page: Page, database: psycopg.Connection) -> None:
    """The conflict is one line; a second attempt is one of a person who has seen it."""
    key = add(database)
    panel = tab(page, "Actions")
    panel.get_by_role("button", name=f"Change action {key}").click()
    database.execute("UPDATE tunnel_api.action SET state = 'ordered', remark = 'at night' WHERE id = %s", [key])
    form = panel.get_by_role("form", name=f"Action {key}")
    form.get_by_label("State").select_option("verified")
    form.get_by_role("button", name="Save").click()
    expect(form.get_by_role("alert")).to_contain_text(f"has changed action {key} in the meantime; nothing was written")
    expect(form.get_by_role("alert")).to_contain_text("nothing was written. In the database: ordered, planned, at night")
    assert stored(database)[0]["state"] == "ordered"
    form.get_by_role("button", name="Save").click()
    expect(panel).to_contain_text("0 of 1 actions")
    assert (stored(database)[0]["state"], stored(database)[0]["remark"]) == ("verified", "at night")
    forgive(page, "status of 409")


def test_filters_and_overdue_first(page: Page, database: psycopg.Connection) -> None:
    add(database, due="2199-01-01", measure="later")
    add(database, due="2020-01-01", measure="late")
    add(database, state="done", due="2020-01-01", measure="ready")
    panel = tab(page, "Actions")
    names = panel.locator(".action strong:first-child")
    expect(panel.locator(".action-head strong")).to_have_text(["late", "later"])
    expect(panel.locator(".action").first).to_contain_text("overdue")
    panel.get_by_label("Overdue only").check()
    expect(panel.locator(".action-head strong")).to_have_text(["late"])
    panel.get_by_label("Overdue only").uncheck()
    panel.get_by_label("State").select_option("done")
    expect(panel.locator(".action-head strong")).to_have_text(["ready"])
    expect(names.first).to_be_visible()


def test_a_viewer_sees_and_cannot_write(context_of: Contexts, database: psycopg.Connection) -> None:
    add(database, due="2020-01-01")
    with opened(context_of("viola_web"), f"/#/{NAME}/finding/1") as page:
        panel = page.locator("#panel-body")
        expect(panel.locator(".finding-actions")).to_contain_text("seal the joint")
        expect(panel.get_by_role("button", name="Add action")).to_have_count(0)
        tab(page, "Actions")
        expect(panel.locator(".action")).to_contain_text("overdue")
        for name in ("Change", "Delete", "Add action"):
            expect(panel.get_by_role("button", name=name)).to_have_count(0)
        tab(page, "Rating")
        expect(panel.locator("tbody tr")).to_have_count(5)


@pytest.mark.parametrize("settings", [{}, PHONE], ids=["1440", "390"])
def test_axe_and_the_width_of_a_phone(context_of: Contexts, database: psycopg.Connection, settings: dict[str, Any]) -> None:
    """Rating, actions, their form and the finding: no serious finding of axe, and nothing wider than the screen."""
    add(database, due="2020-01-01", responsible="Works Ltd", cost=1200, currency="EUR")
    add(database, measure="Observe the crack at the crown joint of ring 12 during the next inspection", urgency="monitor")
    found = {}
    with opened(context_of("ines_web", **settings), f"/#/{NAME}/finding/1") as page:
        expect(page.locator(".finding-actions")).to_contain_text("Actions (2)")
        found["finding"] = accessibility_findings(page)
        for name, shown in (("Rating", "tbody tr"), ("Actions", ".action")):
            tab(page, name)
            expect(page.locator("#panel-body").locator(shown).first).to_be_visible()
            settled(page)
            if name == "Rating":
                page.locator("#panel-body").get_by_role("button", name="block 1", exact=True).click()
            found[name] = accessibility_findings(page)
            assert not page.evaluate(
                "document.documentElement.scrollWidth > innerWidth || document.body.scrollWidth > innerWidth"
            )
        page.get_by_role("button", name="Add action for finding 1").click()
        found["form"] = accessibility_findings(page)
        tab(page, "Finding")
        page.locator(".finding-actions").scroll_into_view_if_needed()
    assert {name: some for name, some in found.items() if some} == {}
