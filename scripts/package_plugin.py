"""Package the QGIS plugin of ``qgis_plugin/`` as QGIS installs it from a zip.

Usage: scripts/package_plugin.py [FOLDER]     # writes FOLDER/tunneldb_review-VERSION.zip, by default into dist

The version is that of tunneldb. The same files make the same zip.
"""

from __future__ import annotations

import re
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NAME = "tunneldb_review"
SOURCE = ROOT / "qgis_plugin" / NAME
ENDINGS = (".py", ".txt", ".svg")
_BEGINNING = (1980, 1, 1, 0, 0, 0)  # the earliest that a zip knows


def version() -> str:
    """Return the version of tunneldb, from the only place that has it."""
    found = re.search(r'^__version__ = "(.+)"$', (ROOT / "tunneldb" / "__init__.py").read_text("utf-8"), re.MULTILINE)
    if found is None:
        raise SystemExit("tunneldb/__init__.py states no __version__")
    return found[1]


def package(folder: Path) -> Path:
    """Write the zip into a folder, made if it isn't there, and return its path."""
    folder.mkdir(parents=True, exist_ok=True)
    target = folder / f"{NAME}-{version()}.zip"
    files = {path.relative_to(SOURCE.parent).as_posix(): path.read_text("utf-8") for path in _files()}
    files[f"{NAME}/metadata.txt"] = re.sub(r"(?m)^version=.*$", f"version={version()}", files[f"{NAME}/metadata.txt"])
    files[f"{NAME}/LICENSE"] = (ROOT / "LICENSE").read_text("utf-8")
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in sorted(files.items()):
            entry = zipfile.ZipInfo(name, _BEGINNING)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, text)
    return target


def _files() -> list[Path]:
    return [path for path in SOURCE.rglob("*") if path.suffix in ENDINGS and "__pycache__" not in path.parts]


if __name__ == "__main__":
    print(package(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "dist"))
