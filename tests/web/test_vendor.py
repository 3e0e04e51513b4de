"""Libraries of the page: the committed files are those of the lock, with their licences, and travel in the package."""

from __future__ import annotations

import gzip
import hashlib
import json
from importlib.resources import files
from pathlib import Path

STATIC = Path(str(files("tunneldb.web"))) / "static"
VENDOR = STATIC / "vendor"


def test_files_are_those_of_the_lock() -> None:
    lock = json.loads((VENDOR / "vendor.json").read_text())
    files_of = [package["files"] for package in lock["packages"]]
    listed = {name: checksum for found in (*files_of, lock["generated"]) for name, checksum in found.items()}
    assert all(package["integrity"].startswith("sha512-") for package in lock["packages"])
    for name, checksum in listed.items():
        assert hashlib.sha256((VENDOR / name).read_bytes()).hexdigest() == checksum, name
    there = {str(path.relative_to(VENDOR)) for path in VENDOR.rglob("*") if path.is_file()} - {"vendor.json"}
    assert there == set(listed)


def test_licences_are_there() -> None:
    text = (VENDOR / "ol" / "LICENSE.md").read_text()
    assert "BSD 2-Clause" in text
    assert len((VENDOR / "ol" / "LICENSES.txt").read_text()) > 5000
    assert "MIT License" in (VENDOR / "three" / "LICENSE").read_text()


def test_page_is_light() -> None:
    """Compressed, before the first tile; three.js comes when the 3D view opens."""
    sent = [
        path for path in STATIC.rglob("*") if path.suffix in (".js", ".css", ".svg") and path != VENDOR / "three" / "three.js"
    ]
    assert sum(len(gzip.compress(path.read_bytes())) for path in sent) <= 600_000
    assert len(gzip.compress((VENDOR / "three" / "three.js").read_bytes())) <= 200_000
    assert [path.name for path in sent if "/three/" in path.read_text()] == ["space_scene.js"]
    assert not [path.name for path in sent if "from './space_scene.js'" in path.read_text()]


def test_nothing_is_loaded_from_elsewhere() -> None:
    for path in [*STATIC.glob("*.js"), *STATIC.glob("*.css"), *(STATIC.parent / "templates").glob("*.html")]:
        text = path.read_text()
        for mark in ("http://", "https://"):
            rest = text.replace("http://www.w3.org/", "").replace("https://openlayers.org", "")
            assert mark not in rest, path.name
        assert " onclick=" not in text
        assert "innerHTML" not in text
