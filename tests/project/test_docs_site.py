"""The documentation as a site: it builds, shows what the repository shows, and is read in Chromium without a network."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path

import pytest
from markdown_it import MarkdownIt
from playwright.sync_api import Browser, sync_playwright
from support.reference import docs_script

pytestmark = [pytest.mark.server, pytest.mark.slow]

ROOT = Path(__file__).parents[2]
SOURCES = {page.stem: page for page in sorted((ROOT / "docs").glob("*.md"))} | {
    "overview": ROOT / "README.md",
    "contributing": ROOT / "CONTRIBUTING.md",
    "changes": ROOT / "CHANGELOG.md",
}
COMPARED = {"h1", "h2", "h3", "h4", "p", "ul", "ol", "li", "table", "tr", "td", "pre", "code", "img", "a", "strong", "em"}
DIAGRAM = re.compile(r"^```mermaid\n.*?^```$", re.MULTILINE | re.DOTALL)


def copy_project(folder: Path) -> Path:
    """Copy what the site is made from, and write the generated parts of the reference."""
    for name in ("mkdocs.yml", "README.md", "CONTRIBUTING.md", "CHANGELOG.md", "LICENSE"):
        shutil.copy(ROOT / name, folder)
    shutil.copytree(ROOT / "docs", folder / "docs", ignore=shutil.ignore_patterns("__pycache__"))
    docs_script("generate_reference").generate(folder / "build" / "reference")
    return folder


def build(project: Path, site: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", site],
        cwd=project,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return copy_project(tmp_path_factory.mktemp("project"))


@pytest.fixture(scope="module")
def site(project: Path) -> Path:
    built = build(project, project / "site")
    assert built.returncode == 0, built.stderr
    return project / "site"


class Elements(HTMLParser):
    """Elements of a page's text by kind, and what the whole page fetches."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.inside = False
        self.found: Counter[str] = Counter()
        self.fetched: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        attributes = dict(attrs)
        self.inside |= tag == "article"
        if self.inside and tag in COMPARED and attributes.get("class") != "headerlink":
            self.found[tag] += 1
        if tag in ("script", "img", "iframe", "source"):
            self.fetched.append(attributes.get("src") or "")
        elif tag == "link":
            self.fetched.append(attributes.get("href") or "")

    def handle_endtag(self, tag: str) -> None:
        self.inside &= tag != "article"


@pytest.mark.parametrize("name", SOURCES)
def test_pages_show_what_the_repository_shows(site: Path, project: Path, name: str) -> None:
    """MkDocs reads Markdown by older rules: lists after a line of text, or indented by two, would be running text."""
    text = DIAGRAM.sub("![picture](of.svg)", SOURCES[name].read_text("utf-8"))
    reference = project / "build" / "reference"
    text = docs_script("site_hooks").PART.sub(lambda part: (reference / f"{part[1]}.md").read_text("utf-8"), text)
    expected = Elements(f"<article>{MarkdownIt('commonmark').enable('table').render(text)}</article>").found
    assert Elements((site / f"{name}.html").read_text("utf-8")).found == expected


def test_every_page_is_in_the_navigation(site: Path) -> None:
    index = (site / "index.html").read_text("utf-8")
    linked = set(re.findall(r'<a href="([\w.-]+)\.html" class="md-nav__link', index))
    assert linked >= SOURCES.keys() - {"index"}


def test_nothing_is_fetched_from_elsewhere(site: Path) -> None:
    pages = {page.name: Elements(page.read_text("utf-8")).fetched for page in site.glob("*.html")}
    assert [(page, source) for page, all_of_it in pages.items() for source in all_of_it if "//" in source] == []
    imports = [
        sheet.name for sheet in site.rglob("*.css") if re.search(r"(@import|url\()\s*['\"]?(https?:)?//", sheet.read_text())
    ]
    assert imports == []


def test_dead_links_and_anchors_and_what_was_not_generated_fail(tmp_path: Path, project: Path) -> None:
    shutil.copytree(project, tmp_path, ignore=shutil.ignore_patterns("site", "views.md"), dirs_exist_ok=True)
    with (tmp_path / "docs" / "index.md").open("a") as page:
        page.write(
            "\n[a](nowhere.md) [b](classes.md#nowhere) [c](../README.md#nowhere)\n\n```mermaid\nflowchart\n  a --> b\n```\n"
        )
    built = build(tmp_path, tmp_path / "site")
    assert built.returncode != 0
    for complaint in (
        "'nowhere.md'",
        "'classes.md#nowhere'",
        "'overview.md#nowhere'",
        "generate_diagrams.py",
        "generate_reference.py",
    ):
        assert complaint in built.stderr


@pytest.fixture(scope="module")
def browser(chromium: Path) -> Iterator[Browser]:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        yield browser
        browser.close()


def test_read_from_the_disk(site: Path, browser: Browser) -> None:
    """The diagram is drawn, and the search leads from one page to another, with nothing but files."""
    page = browser.new_page()
    troubles: list[str] = []
    page.on("console", lambda message: troubles.append(message.text) if message.type == "error" else None)
    page.on(
        "request",
        lambda request: troubles.append(request.url) if not request.url.startswith(("file:", "data:", "blob:")) else None,
    )
    page.goto((site / "methods.html").as_uri())
    assert page.locator('img[src^="images/diagram-"]').evaluate("image => image.complete && image.naturalWidth") > 0
    page.locator("input.md-search__input").fill("leak_statistics")
    page.locator('.md-search-result__link[href*="reference-sql.html"]').first.click()
    page.wait_for_url("**/reference-sql.html**")
    assert troubles == []
    page.close()


def test_fits_a_phone(site: Path, browser: Browser) -> None:
    page = browser.new_page(viewport={"width": 375, "height": 700})
    wide = []
    for name in ("index", "overview", "tutorial", "figures", "methods", "decisions", "reference-cli"):
        page.goto((site / f"{name}.html").as_uri())
        if page.evaluate("document.documentElement.scrollWidth") > 375:
            wide.append(name)
    page.close()
    assert wide == []
