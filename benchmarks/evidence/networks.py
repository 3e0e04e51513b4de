"""Segmentation networks for families of tunnels: each family is seen by a network that was not trained on it."""

from __future__ import annotations

from pathlib import Path

from tunneldb.segmentation.network import Network, runtime


class Networks:
    """Networks in a folder, by the families that their training left out; none without a folder."""

    def __init__(self, folder: Path | None) -> None:
        self._without = {path: without(path) for path in sorted(folder.glob("*.onnx"))} if folder else {}
        self._loaded: dict[Path, Network] = {}

    def of(self, family: str) -> Network | None:
        """Return the network that has not seen a family; None if there are no networks at all."""
        if not self._without:
            return None
        path = next((path for path, left_out in self._without.items() if family in left_out), None)
        if path is None:
            raise SystemExit(f"each of the networks {', '.join(p.name for p in self._without)} was trained on {family}")
        if path not in self._loaded:
            self._loaded[path] = Network.load(path.read_bytes(), path.stem)
        return self._loaded[path]


def without(path: Path) -> set[str]:
    """Return the families that the training of a network left out."""
    session = runtime().InferenceSession(str(path), providers=["CPUExecutionProvider"])
    return set(session.get_modelmeta().custom_metadata_map.get("without", "").split())
