"""What MkDocs cannot do by itself: pages from outside of docs/, and diagrams without JavaScript from elsewhere.

The pages are written to be read in the repository. There they lead to the README and back, and a block ``mermaid`` is
drawn by whoever shows it; here the README is a page of the site, and such a block is the picture of it that
``docs/generate_diagrams.py`` has drawn. Lists that are generated from the program, such as its commands,
are not in the repository: a comment in the page says where each belongs, and ``docs/generate_reference.py`` writes them.
"""

from __future__ import annotations

import hashlib
import logging
import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[1]
OUTSIDE = {
    "README.md": "overview.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changes.md",
    "LICENSE": "license.txt",
}
REFERENCE = ROOT / "build" / "reference"
PART = re.compile(r"<!-- make docs: (\w+) -->")
LINK = re.compile(r"\]\(([^)\s#]+)")
DIAGRAM = re.compile(r"^```mermaid\n(.*?)^```$", re.MULTILINE | re.DOTALL)

log = logging.getLogger("mkdocs.hooks.tunneldb")


def diagram(code: str) -> str:
    """Return the name of the picture of a Mermaid diagram: that of its text, so that an old picture cannot stand for it."""
    return f"diagram-{hashlib.sha256(code.encode()).hexdigest()[:8]}.svg"


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages from outside, with their links as seen from docs/."""
    for path, name in OUTSIDE.items():
        text = (ROOT / path).read_text("utf-8")
        if name.endswith(".md"):
            text = LINK.sub(lambda link: f"]({_inside(link[1])}", text)
        files.append(File.generated(config, name, content=text))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Lead links to the README to its page; put pictures in place of diagrams, and parts of the reference in their places."""
    markdown = PART.sub(lambda part: _reference(part[1]), markdown)
    markdown = LINK.sub(lambda link: f"]({OUTSIDE.get(link[1].removeprefix('../'), link[1])}", markdown)
    return DIAGRAM.sub(lambda block: _picture(block[1], files), markdown)


def _reference(part: str) -> str:
    path = REFERENCE / f"{part}.md"
    if not path.exists():
        log.warning(f"no {path.relative_to(ROOT)}: python docs/generate_reference.py writes it")
        return ""
    return path.read_text("utf-8").strip()


def _inside(target: str) -> str:
    return OUTSIDE.get(target, target.removeprefix("docs/"))


def _picture(code: str, files: Files) -> str:
    path = f"images/{diagram(code)}"
    if files.get_file_from_path(path) is None:
        log.warning("no picture of a Mermaid diagram: python docs/generate_diagrams.py draws it")
    return f"![Diagram]({path})"
