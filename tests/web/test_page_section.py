"""The page in Chromium: section with design and gauge, and its downloads; map of the tunnels."""

from __future__ import annotations

import re

import ezdxf
import psycopg
from playwright.sync_api import BrowserContext, Page, expect
from support.desk_page import opened, tab
from support.example_survey import NAME


def test_section_names_its_lines_and_downloads_as_a_drawing(page: Page) -> None:
    """Design and gauge are in the key; the DXF is that of the section shown."""
    panel = tab(page, "Section")
    panel.get_by_label("Chainage").fill("12+350")
    panel.get_by_role("button", name="Show").click()
    expect(panel.get_by_role("img", name=re.compile(r"Section at 12\+350"))).to_be_visible()
    key = panel.locator(".key li")
    expect(key.filter(has_text="design (lining: round)")).to_have_count(1)
    expect(key.filter(has_text="gauge (example, track single)")).to_have_count(1)
    with page.expect_download() as waiting:
        panel.get_by_role("link", name="Download DXF").click()
    assert waiting.value.suggested_filename == f"section-{NAME}-12350.00.dxf"
    drawing = ezdxf.readfile(waiting.value.path())
    assert {entity.dxf.layer for entity in drawing.modelspace()} >= {"SECTION", "DESIGN", "GAUGE", "AXIS", "TEXT"}


def test_ribbon_tells_the_deviation(page: Page) -> None:
    """The ribbon states the smallest and the greatest deviation at the pointer."""
    strip = page.locator("#ribbon canvas")
    expect(page.locator("#ribbon .labels")).to_contain_text("Deviation")
    box = strip.bounding_box()
    assert box is not None
    low, high = (float(strip.get_attribute(f"aria-value{end}") or "nan") for end in ("min", "max"))
    strip.hover(position={"x": (12341.5 - low) / (high - low) * box["width"], "y": 20})
    expect(page.locator("#ribbon .tip")).to_contain_text("deviation of the lining -100\u00a0mm to 60\u00a0mm")


def test_a_tunnel_is_picked_on_the_map(ines_context: BrowserContext, database: psycopg.Connection) -> None:
    """Its surveys remain in the table; the button shows all again. The dot of the only tunnel is in the middle of the map."""
    with opened(ines_context, "/") as page:
        rows = page.locator("#surveys tbody tr")
        expect(rows).to_have_count(2)
        shown = page.get_by_role("region", name="Map of the tunnels")
        expect(shown.locator("canvas").first).to_be_visible()
        box = shown.bounding_box()
        assert box is not None
        page.wait_for_function("document.querySelector('.tunnel-map canvas').width > 0")
        shown.click(position={"x": box["width"] / 2, "y": box["height"] / 2})
        expect(page.get_by_label("Filter")).to_have_value("demo")
        page.get_by_label("Filter").fill("nothing")
        expect(rows).to_have_count(0)
        page.get_by_role("button", name="All tunnels").click()
        expect(rows).to_have_count(2)
