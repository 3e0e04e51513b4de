"""Package the QGIS plugin of ``qgis_plugin/`` as QGIS installs it from a zip.

    scripts/package_plugin.py                  # dist/tunneldb_review-VERSION.zip
    scripts/package_plugin.py FOLDER --email … --homepage … --repository … --tracker …

The version is that of tunneldb, and the algorithms are generated from its commands (`plugin_catalogue.py`). The same files
make the same zip. plugins.qgis.org takes a zip only if its metadata name an e-mail address and three pages that can be reached:
who publishes there gives all four; QGIS installs a zip without them.
"""

from __future__ import annotations

import argparse
import re
import zipfile
from collections.abc import Mapping
from pathlib import Path

from plugin_catalogue import catalogue

ROOT = Path(__file__).resolve().parents[1]
NAME = "tunneldb_review"
SOURCE = ROOT / "qgis_plugin" / NAME
ENDINGS = (".py", ".txt", ".svg")
PUBLISHER = {
    "email": "where its publisher can be reached", "homepage": "URL of its manual", "repository": "URL of its code",
    "tracker": "URL where faults are reported",
}  # fmt: skip
"""What plugins.qgis.org wants to know beside what metadata.txt says."""
_BEGINNING = (1980, 1, 1, 0, 0, 0)  # the earliest that a zip knows


def version() -> str:
    """Return the version of tunneldb, from the only place that has it."""
    found = re.search(r'^__version__ = "(.+)"$', (ROOT / "tunneldb" / "__init__.py").read_text("utf-8"), re.MULTILINE)
    if found is None:
        raise SystemExit("tunneldb/__init__.py states no __version__")
    return found[1]


def package(folder: Path, publisher: Mapping[str, str] | None = None) -> Path:
    """Write the zip into a folder, made if it isn't there, and return its path.

    Parameters
    ----------
    folder : Path
    publisher : mapping, optional
        What of PUBLISHER is written into its metadata.
    """
    folder.mkdir(parents=True, exist_ok=True)
    target = folder / f"{NAME}-{version()}.zip"
    files = {path.relative_to(SOURCE.parent).as_posix(): path.read_text("utf-8") for path in _files()}
    metadata = re.sub(r"(?m)^version=.*$", f"version={version()}", files[f"{NAME}/metadata.txt"])
    files[f"{NAME}/metadata.txt"] = metadata + "".join(f"{name}={value}\n" for name, value in (publisher or {}).items())
    files[f"{NAME}/catalogue.py"] = catalogue()
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


def main() -> None:
    """Package as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "dist", help="default: dist")
    for name, text in PUBLISHER.items():
        parser.add_argument(f"--{name}", help=text)
    arguments = vars(parser.parse_args())
    given = {name: arguments[name] for name in PUBLISHER if arguments[name]}
    if given and len(given) < len(PUBLISHER):
        parser.error(f"to publish, give --{', --'.join(name for name in PUBLISHER if name not in given)}, too")
    if any("\n" in value or "%" in value for value in given.values()):
        parser.error("neither line breaks nor % may stand in what is published")
    print(package(arguments["folder"], given))


if __name__ == "__main__":
    main()
