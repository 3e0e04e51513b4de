"""Fetch the JavaScript libraries of the desk from npm into ``tunneldb/web/static/vendor/``.

    scripts/vendor_web.py            # write the pinned versions of vendor.json again
    scripts/vendor_web.py --update   # take the newest versions, and pin them

Only this script needs npm: the files it writes are committed and travel in the wheel. ``vendor.json`` has the version and the
integrity of each npm package, and the SHA-256 of each file. Packages with ``"files": {}`` are compiled into ``ol.js``: only
their licences are kept, in ``LICENSES.txt``. The 3D view uses a small part of three.js, which esbuild compiles into
``three.js``.
"""

from __future__ import annotations

import argparse
import base64
import hashlib
import json
import subprocess
import tarfile
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
VENDOR = ROOT / "tunneldb" / "web" / "static" / "vendor"
LOCK = VENDOR / "vendor.json"
LICENCES = "ol/LICENSES.txt"
PACKAGES: dict[str, tuple[str, dict[str, str]]] = {
    "ol": ("10", {"dist/ol.js": "ol/ol.js", "ol.css": "ol/ol.css", "LICENSE.md": "ol/LICENSE.md"}),
    "earcut": ("3", {}),
    "geotiff": ("3", {}),
    "pbf": ("5", {}),
    "quickselect": ("3", {}),
    "rbush": ("4", {}),
    "zarrita": ("0.7", {}),
    "three": ("0", {"LICENSE": "three/LICENSE"}),
    "idb": ("8", {"build/index.js": "idb/idb.js", "LICENSE": "idb/LICENSE"}),
}
"""Range of versions of each package, and its files: path in the package, path below ``vendor/``."""

OWN_LICENCE = ("three", "idb")
"""Packages whose licence is a file beside them."""

THREE, ESBUILD = "three/three.js", "0.28.2"
"""Module of the 3D view, and the version of esbuild that writes it."""

THREE_ENTRY = """
export {
  BufferAttribute, BufferGeometry, ColorManagement, Fog, LinearSRGBColorSpace, PerspectiveCamera, Points, PointsMaterial,
  Raycaster, Scene, Vector2, Vector3, WebGLRenderer,
} from 'three';
export { OrbitControls } from 'three/addons/controls/OrbitControls.js';
export { LineMaterial } from 'three/addons/lines/LineMaterial.js';
export { LineSegments2 } from 'three/addons/lines/LineSegments2.js';
export { LineSegmentsGeometry } from 'three/addons/lines/LineSegmentsGeometry.js';
"""
"""Entry module with the parts of three.js that the 3D view uses."""


def main() -> None:
    """Write the files and the lock."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--update", action="store_true", help="pin the newest versions in the ranges of this script")
    update = parser.parse_args().update or not LOCK.exists()
    pinned = {} if update else {item["package"]: item for item in json.loads(LOCK.read_text("utf-8"))["packages"]}
    items, licences = [], []
    for package, (versions, files) in PACKAGES.items():
        wanted = pinned[package]["version"] if package in pinned else versions
        with tempfile.TemporaryDirectory() as folder:
            item, licence = fetch(package, wanted, files, Path(folder), pinned.get(package))
            if package == "three":
                three = bundle(Path(folder), item["version"])
        items.append(item)
        if package in OWN_LICENCE:
            continue
        licences.append(f"{package} {item['version']}\n\n{licence.strip()}\n")
    text = "Libraries that are compiled into ol.js, with their licences.\n\n" + ("\n" + "-" * 80 + "\n\n").join(licences)
    (VENDOR / LICENCES).write_text(text, "utf-8")
    lock = {"packages": items, "generated": {LICENCES: digest(text.encode()), THREE: digest(three)}}
    LOCK.write_text(json.dumps(lock, indent=2) + "\n", "utf-8")
    print(f"{LOCK}: {len(items)} packages")


def fetch(
    package: str, versions: str, files: dict[str, str], folder: Path, pinned: dict[str, Any] | None
) -> tuple[dict[str, Any], str]:
    """Download a package, write its files, and return its entry of the lock and its licence.

    Raises
    ------
    SystemExit
        npm fails, or the package differs from the pinned one.
    """
    packed = npm("pack", f"{package}@{newest(package, versions)}", "--json", "--pack-destination", str(folder))
    found = json.loads(packed)[0]
    archive = folder / found["filename"].replace("@", "").replace("/", "-")
    integrity = "sha512-" + base64.b64encode(hashlib.sha512(archive.read_bytes()).digest()).decode()
    for expected in (found["integrity"], pinned["integrity"] if pinned else integrity):
        if integrity != expected:
            raise SystemExit(f"Error: {package} {found['version']}: integrity {integrity}, expected {expected}")
    hashes = {}
    with tarfile.open(archive) as tar:
        for name, target in files.items():
            content = member(tar, name)
            path = VENDOR / target
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
            hashes[target] = digest(content)
        licence = next(name for name in tar.getnames() if name.lower().startswith("package/licen") and name.count("/") == 1)
        text = member(tar, licence.removeprefix("package/")).decode("utf-8")
        described = json.loads(member(tar, "package.json"))
    entry = {
        "package": package, "version": found["version"], "integrity": integrity, "licence": described.get("license", ""),
        "files": hashes,
    }  # fmt: skip
    return entry, text


def bundle(folder: Path, version: str) -> bytes:
    """Write the module of the 3D view from the package in a folder; return its content."""
    with tarfile.open(folder / f"three-{version}.tgz") as tar:
        tar.extractall(folder, filter="data")
    (folder / "node_modules").mkdir()
    (folder / "package").rename(folder / "node_modules" / "three")
    (folder / "entry.js").write_text(THREE_ENTRY, "utf-8")
    options = ["--bundle", "--minify", "--format=esm", "--legal-comments=inline", f"--outfile={VENDOR / THREE}"]
    npm("exec", "--yes", f"--package=esbuild@{ESBUILD}", "--", "esbuild", str(folder / "entry.js"), *options)
    return (VENDOR / THREE).read_bytes()


def newest(package: str, versions: str) -> str:
    """Return the newest version of a range; a version is its own range."""
    found = json.loads(npm("view", f"{package}@{versions}", "version", "--json"))
    if isinstance(found, str):
        return found
    return str(max(found, key=lambda version: [int(part) for part in version.split("-")[0].split(".")]))


def member(tar: tarfile.TarFile, name: str) -> bytes:
    """Return the content of a file of a package."""
    file = tar.extractfile(f"package/{name}")
    if file is None:
        raise SystemExit(f"Error: the package has no file {name}")
    return file.read()


def digest(content: bytes) -> str:
    """Return the SHA-256 of bytes, hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def npm(*words: str) -> str:
    """Run npm, and return its output."""
    try:
        return subprocess.run(["npm", *words], check=True, capture_output=True, text=True).stdout
    except FileNotFoundError:
        raise SystemExit("Error: npm is missing: install Node.js, only this script needs it") from None
    except subprocess.CalledProcessError as error:
        raise SystemExit(f"Error: npm {' '.join(words)}: {error.stderr.strip().splitlines()[-1]}") from None


if __name__ == "__main__":
    main()
