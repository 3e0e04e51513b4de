"""What a server of OGC API Features gives of a database, held against SQL: by HTTP, and in QGIS.

    python -m benchmarks.ogc_api URL SRID             # tipg runs there, on the database at hand (docs/howto-ogc-api.md)
    python -m benchmarks.ogc_api URL SRID --no-qgis

Each layer that ``docker-compose.yml`` names must be a collection with as many features as it has rows, and nothing else may be
one; whatever would write must be refused. What is not as it should be is printed, and the exit code is 1.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

from psycopg import sql
from ruamel.yaml import YAML

from benchmarks.common import print_table
from tunneldb.database import connect, resolve_dsn

SCRIPT = Path(__file__).with_name("ogc_api_in_qgis.py")
COMPOSE = Path(__file__).parents[1] / "docker-compose.yml"
PYTHON = "/usr/bin/python3"  # that which QGIS is built for
REFUSED = {404, 405}
HIDDEN = (
    "tunnel_api.leak_map",
    "tunnel_api.leak_unrolled",
    "tunnel_api.audit",
    "tunnel.finding",
    "tunnel_api.leak_statistics",
    "public.layer_styles",
)
"""A view that states no coordinate system, one of the unrolled plane, one without a place, a table, a function, a table of
another schema."""


def rows_of_layers(srid: int) -> dict[str, int]:
    """Rows of each layer that is to be served, by the name of its collection."""
    environment = YAML(typ="safe").load(COMPOSE)["services"]["ogc-api"]["environment"]
    found = {}
    with connect(resolve_dsn(None)) as conn:
        for name in json.loads(environment["TIPG_DB_TABLES"].replace("${OGC_SRID:-0}", str(srid))):
            query = sql.SQL("SELECT count(*) FROM {}").format(sql.Identifier(*name.split(".")))
            row = conn.execute(query).fetchone()
            found[name] = int(row[0]) if row else 0
    return found


def answer(url: str) -> Any:
    with urlopen(url) as response:
        return json.load(response)


def status(url: str, method: str = "GET") -> int:
    try:
        with urlopen(Request(url, method=method, data=b"{}" if method in {"POST", "PUT", "PATCH"} else None)) as response:
            return int(response.status)
    except HTTPError as error:
        return error.code


def by_http(url: str, expected: dict[str, int]) -> list[str]:
    """Return the faults of the server's answers."""
    served = {collection["id"] for collection in answer(f"{url}/collections?f=json&limit=1000")["collections"]}
    wrong = [f"{name} is served" for name in sorted(served - set(expected))]
    wrong += [f"{name} is not served" for name in sorted(set(expected) - served)]
    for name in sorted(served & set(expected)):
        ids: list[Any] = []
        while True:
            page = answer(f"{url}/collections/{name}/items?f=geojson&limit=100&offset={len(ids)}")
            ids += [feature["id"] for feature in page["features"]]
            if not page["features"]:
                break
        if len(ids) != expected[name] or len(set(ids)) != len(ids):
            wrong.append(f"{name}: {len(set(ids))} features, {expected[name]} rows")
    wrong += [
        f"{method} of {name} is answered by {found}"
        for name in (next(name for name in expected if name.endswith(".leak_map")), "tunnel_api.leak_map")
        for method in ("POST", "PUT", "PATCH", "DELETE")
        if (found := status(f"{url}/collections/{name}/items", method)) not in REFUSED
    ]
    return wrong + [f"{name} can be read" for name in HIDDEN if status(f"{url}/collections/{name}/items") != 404]


def in_qgis(url: str, expected: dict[str, int]) -> tuple[str, list[str]]:
    """Version of QGIS, and what it finds otherwise."""
    done = subprocess.run(
        [PYTHON, str(SCRIPT), url],
        env={name: os.environ[name] for name in ("PATH", "HOME") if name in os.environ} | {"QT_QPA_PLATFORM": "offscreen"},
        capture_output=True,
        text=True,
        check=True,
    )
    found = json.loads(done.stdout.splitlines()[-1])
    wrong = []
    for name, rows in expected.items():
        layer = found["collections"].get(name, {"valid": False, "rows": None})
        right = layer["valid"] and layer["rows"] == rows and not layer["writes"] and layer.get("pixels", 1) > 0
        if not right or (rows and layer["crs"] != "EPSG:4326"):
            wrong.append(f"QGIS: {name}: {layer}, {rows} rows")
    return found["version"], wrong


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("url", metavar="URL")
    parser.add_argument("srid", metavar="SRID", type=int)
    parser.add_argument("--no-qgis", action="store_true")
    options = parser.parse_args()
    url = options.url.rstrip("/")
    expected = rows_of_layers(options.srid)
    wrong = by_http(url, expected)
    version = "not asked"
    if not options.no_qgis:
        version, found = in_qgis(url, expected)
        wrong += found
    print_table("OGC API", ["collection", "rows"], list(expected.items()))
    print(f"QGIS {version}: " + ("\n".join(wrong) or "all as in SQL, and nothing can be written"))
    raise SystemExit(1 if wrong else 0)


if __name__ == "__main__":
    main()
