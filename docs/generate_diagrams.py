"""Draw the Mermaid diagrams of the pages as ``docs/images/diagram-….svg``, for the site, which loads no JavaScript for them.

    python docs/generate_diagrams.py

needs npm, which fetches Mermaid, and Chromium, which draws. A diagram whose picture is there is not drawn again; pictures
whose diagram is gone are removed.
"""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

from playwright.sync_api import Page, sync_playwright
from site_hooks import DIAGRAM, ROOT, diagram

IMAGES = ROOT / "docs" / "images"
CHROMIUM = "/usr/bin/chromium"
# Labels as SVG text, not as HTML: an <img> shows no HTML inside of an SVG.
CONFIG = {"startOnLoad": False, "theme": "neutral", "htmlLabels": False, "flowchart": {"htmlLabels": False}}


def wanted() -> dict[Path, str]:
    """Return each picture that the pages need, and the code that it is drawn from."""
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    blocks = (block for page in pages for block in DIAGRAM.findall(page.read_text("utf-8")))
    return {IMAGES / diagram(code): code for code in blocks}


def fetch_mermaid(folder: Path) -> Path:
    """Fetch the library from the npm registry."""
    subprocess.run(["npm", "install", "--silent", "--prefix", folder, "mermaid@11"], check=True)
    return folder / "node_modules" / "mermaid" / "dist" / "mermaid.min.js"


def draw(page: Page, code: str) -> str:
    """Return a diagram as SVG with a size of its own."""
    return str(
        page.evaluate(
            """async ([code, config]) => {
                mermaid.initialize(config);
                const holder = document.createElement('div');
                holder.innerHTML = (await mermaid.render('diagram', code)).svg;
                const svg = holder.querySelector('svg'), box = svg.viewBox.baseVal;
                svg.setAttribute('width', Math.ceil(box.width));
                svg.setAttribute('height', Math.ceil(box.height));
                return new XMLSerializer().serializeToString(svg);
            }""",
            [code, CONFIG],
        )
    )


def main() -> None:
    """Draw what is missing, remove what is not needed any more."""
    pictures = wanted()
    for old in set(IMAGES.glob("diagram-*.svg")) - pictures.keys():
        old.unlink()
    missing = {path: code for path, code in pictures.items() if not path.exists()}
    if not missing:
        return
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page()
        page.add_script_tag(path=fetch_mermaid(Path(folder)))
        for path, code in missing.items():
            path.write_text(draw(page, code) + "\n", encoding="utf-8")
            print(path)
        browser.close()


if __name__ == "__main__":
    main()
