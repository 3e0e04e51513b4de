"""Go through the tutorial from its first line to its last, and take its pictures on the way: ``docs/images/tutorial-….png``.

Each block of commands is run as it stands in the page, in a fresh folder; where the page shows a picture, what it tells to
do in QGIS Desktop is done there (``docs/in_qgis.py``), or the report is opened in Chromium. So a tutorial that does not work
has no pictures. Needs QGIS Desktop, Xvfb and Chromium (packages ``qgis``, ``xvfb``, ``chromium``), and tunneldb on the PATH.
"""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

FOLDER = Path(__file__).parent
PAGE = FOLDER / "tutorial.md"
STEP = re.compile(r"^```sh\n(?P<code>.*?)^```$|\(images/tutorial-(?P<picture>\w+)\.png\)", re.MULTILINE | re.DOTALL)
SCREEN = "1500x950x24"
REPORT = {"report": "", "leak": "#leak-1"}
"""Pictures of the report, and the place in it that is opened."""


class Terminal:
    """A shell that keeps its folder and its variables from one block to the next."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.state = folder / "state"
        self.state.write_text(f"cd {folder}\n")

    def run(self, code: str) -> str:
        """Run a block as it stands; return what it shows."""
        keep = f"{{ export -p; echo cd $PWD; }} > {self.state}"
        script = f"unset TUNNELDB_DSN; . {self.state}; set -euo pipefail\n{code}\n{keep}"
        done = subprocess.run(["bash", "-c", script], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
        if done.returncode:
            raise RuntimeError(f"{code}\n{done.stdout}")
        return done.stdout


@contextmanager
def screen() -> Iterator[str]:
    """Start an X server without a screen; yield its display."""
    read, write = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", SCREEN, "-nolisten", "tcp"],
        pass_fds=[write],
        stderr=subprocess.DEVNULL,
    )
    os.close(write)
    with os.fdopen(read) as answer:
        display = answer.readline().strip()
    try:
        yield f":{display}"
    finally:
        server.terminate()
        server.wait()


def in_qgis(step: str, project: Path, picture: Path, display: str, profile: Path) -> None:
    """Do a step of the tutorial in QGIS Desktop, with the system's Python and a profile of its own."""
    environment = {
        "PATH": "/usr/bin:/bin", "HOME": str(profile), "DISPLAY": display, "LC_ALL": "C.UTF-8",
        "TUTORIAL_STEP": step, "TUTORIAL_PICTURE": str(picture),
    }  # fmt: skip
    command = ["qgis", "--nologo", "--noversioncheck", "--noplugins", "--profiles-path", profile, "--project", project]
    done = subprocess.run(
        [*command, "--code", FOLDER / "in_qgis.py"], env=environment, capture_output=True, text=True, timeout=300
    )
    if done.returncode or not picture.exists():
        raise RuntimeError(f"{step}: {done.stderr}")


def in_chromium(name: str, report: Path, picture: Path) -> None:
    """Open the report and take a picture of a part of it."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1200, "height": 900})
        page.goto(report.as_uri() + REPORT[name])
        page.wait_for_timeout(1000)  # pictures are unpacked when they come into view
        page.screenshot(path=picture)
        browser.close()


def few_colours(picture: Path) -> None:
    """Store a picture with 256 colours, the rare ones of small outlines among them: a third of its size."""
    colours = Image.open(picture).convert("RGB").quantize(256, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    colours.save(picture, optimize=True)


def take(say: Callable[[str], None] = print) -> None:
    """Go through the tutorial; write its pictures when all of it has worked."""
    with tempfile.TemporaryDirectory(prefix="tutorial-") as folder, screen() as display:
        terminal = Terminal(Path(folder))
        work, profile = Path(folder) / "tutorial", Path(folder) / "profile"
        profile.mkdir()
        pictures = []
        for step in STEP.finditer(PAGE.read_text("utf-8")):
            if step["code"]:
                say(step["code"])
                say(terminal.run(step["code"]))
                continue
            pictures.append(Path(folder) / f"tutorial-{step['picture']}.png")
            if step["picture"] in REPORT:
                in_chromium(step["picture"], work / "report.html", pictures[-1])
            else:
                in_qgis(step["picture"], work / "demo.qgz", pictures[-1], display, profile)
        for picture in pictures:
            few_colours(picture)
            (FOLDER / "images" / picture.name).write_bytes(picture.read_bytes())


if __name__ == "__main__":
    take()
