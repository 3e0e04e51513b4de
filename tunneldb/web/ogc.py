"""OGC API: Features (map layers) and Tiles (the unrolled plane)."""

from __future__ import annotations

import json
from typing import Any

from starlette.responses import Response

from tunneldb.errors import UserError
from tunneldb.numerals import parse_number
from tunneldb.raster.tiles import EDGE, SIZE, ZOOMS
from tunneldb.store.desk import features
from tunneldb.store.desk.features import Layer
from tunneldb.store.desk.images import images
from tunneldb.store.desk.surveys import list_surveys
from tunneldb.web.route import Call, NotFoundError
from tunneldb.web.sessions import Connection
from tunneldb.web.surveys import survey_of

CONFORMANCE = [
    "http://www.opengis.net/spec/ogcapi-common-1/1.0/conf/core",
    "http://www.opengis.net/spec/ogcapi-features-1/1.0/conf/core",
    "http://www.opengis.net/spec/ogcapi-features-1/1.0/conf/geojson",
    "http://www.opengis.net/spec/ogcapi-tiles-1/1.0/conf/core",
    "http://www.opengis.net/spec/ogcapi-tiles-1/1.0/conf/png",
    "http://www.opengis.net/spec/ogcapi-tiles-1/1.0/conf/mvt",
]

CRS84 = "http://www.opengis.net/def/crs/OGC/1.3/CRS84"

MATRIX_SET = "UnrolledPlane"

PAGE, MAX_PAGE = 100, 1000
"""Number of features of an answer, unless ``limit`` states another, and its maximum."""

_PIXEL = 0.00028  # side of a pixel by which OGC defines scales, m


def conformance(call: Call) -> Any:
    """Return what of the standards is implemented."""
    return {"conformsTo": CONFORMANCE}


def collections(call: Call) -> Any:
    """Return the map layers."""
    with call.session.connection() as conn:
        found = features.layers(conn)
    return {"collections": [_described(layer) for layer in found.values()], "links": [_link("self", "/collections")]}


def collection(call: Call) -> Any:
    """Return one map layer."""
    with call.session.connection() as conn:
        return _described(_layer(features.layers(conn), call.path["layer"]))


def items(call: Call) -> Any:
    """Return features of a layer: ``limit``, ``offset``, ``bbox``, and columns that equal a value."""
    limit, offset = _whole(call, "limit", PAGE, 1), _whole(call, "offset", 0, 0)
    with call.session.connection() as conn:
        layer = _layer(features.layers(conn), call.path["layer"])
        equal = {}
        for name, values in call.query.items():
            if name in ("limit", "offset", "bbox", "f"):
                continue
            if name not in layer.columns:
                raise UserError(f"{name[:40]}: {layer.name} has no such column")
            equal[name] = values[0]
        found = features.features(conn, layer, equal, _box(call), min(limit, MAX_PAGE), offset)
    path = f"/collections/{layer.name}/items"
    links = [_link("self", path, "application/geo+json")]
    if len(found) == min(limit, MAX_PAGE):
        links.append(_link("next", f"{path}?limit={limit}&offset={offset + len(found)}", "application/geo+json"))
    content = (
        f'{{"type": "FeatureCollection", "numberReturned": {len(found)}, "links": {json.dumps(links)},'
        f' "features": [{", ".join(found)}]}}'
    )
    return Response(content, media_type="application/geo+json")


def tile_matrix_sets(call: Call) -> Any:
    """Return the grids of tiles."""
    return {"tileMatrixSets": [{"id": MATRIX_SET, "links": [_link("self", f"/tileMatrixSets/{MATRIX_SET}")]}]}


def tile_matrix_set(call: Call) -> Any:
    """Return the grid of the unrolled plane."""
    if call.path["name"] != MATRIX_SET:
        raise NotFoundError(f"there is one grid of tiles, {MATRIX_SET}")
    matrices = []
    for zoom in range(ZOOMS[0], ZOOMS[1] + 1):
        pixel = 2.0 * EDGE / SIZE / 2**zoom
        matrices.append(
            {
                "id": str(zoom), "scaleDenominator": pixel / _PIXEL, "cellSize": pixel, "pointOfOrigin": [-EDGE, EDGE],
                "tileWidth": SIZE, "tileHeight": SIZE, "matrixWidth": 2**zoom, "matrixHeight": 2**zoom,
            }
        )  # fmt: skip
    return {
        "id": MATRIX_SET,
        "title": "Unrolled plane: chainage to the right, arc upwards, m",
        "crs": {"wkt": {"type": "EngineeringCRS", "name": "Unrolled plane (chainage, arc)"}},
        "orderedAxes": ["chainage", "arc"],
        "tileMatrices": matrices,
    }


def tile_sets(call: Call) -> Any:
    """Return the images of all surveys as sets of tiles."""
    with call.session.connection() as conn:
        sets = [
            _tile_set(survey["name"], kind, label)
            for survey in list_surveys(conn)
            for kind, label in _sets(conn, survey["id"]).items()
        ]
    return {"tilesets": sets}


def tile_set(call: Call) -> Any:
    """Return one set of tiles."""
    kind = call.path["kind"]
    with call.session.connection() as conn:
        survey = survey_of(conn, call.path["survey"])
        label = _sets(conn, survey.id).get(kind)
        if label is None:
            raise NotFoundError(f"survey {survey.name} has no image of kind {kind[:40]!r}")
    return _tile_set(survey.name, kind, label)


def _sets(conn: Connection, survey_id: int) -> dict[str, str]:
    """Return the kinds of tiles of a survey with their labels."""
    return {**{image.kind: image.label.lower() for image in images(conn, survey_id)}, "findings": "findings"}


def _tile_set(survey: str, kind: str, label: str) -> dict[str, Any]:
    vector = kind == "findings"
    suffix, media = ("mvt", "application/vnd.mapbox-vector-tile") if vector else ("png", "image/png")
    template = f"/tiles/{survey}/{kind}/{{tileMatrix}}/{{tileCol}}/{{tileRow}}.{suffix}"
    return {
        "title": f"{survey}: {label}",
        "dataType": "vector" if vector else "map",
        "crs": f"/tileMatrixSets/{MATRIX_SET}",
        "tileMatrixSetURI": f"/tileMatrixSets/{MATRIX_SET}",
        "links": [
            _link("self", f"/tiles/{survey}/{kind}"),
            {**_link("item", template, media), "templated": True},
            _link("http://www.opengis.net/def/rel/ogc/1.0/tiling-scheme", f"/tileMatrixSets/{MATRIX_SET}"),
        ],
    }


def _described(layer: Layer) -> dict[str, Any]:
    return {
        "id": layer.name,
        "title": layer.name,
        "description": layer.title,
        "itemType": "feature",
        "crs": [CRS84],
        "links": [
            _link("self", f"/collections/{layer.name}"),
            _link("items", f"/collections/{layer.name}/items", "application/geo+json"),
        ],
    }


def _layer(found: dict[str, Layer], name: str) -> Layer:
    if name not in found:
        raise NotFoundError(f"there is no map layer {name[:80]!r}")
    return found[name]


def _link(rel: str, href: str, media: str = "application/json") -> dict[str, Any]:
    return {"rel": rel, "href": href, "type": media}


def _whole(call: Call, name: str, default: int, least: int) -> int:
    value = call.number(name, default)
    if not least <= value < 1e9 or value != int(value):
        raise UserError(f"{name} is a whole number from {least}")
    return int(value)


def _box(call: Call) -> tuple[float, float, float, float] | None:
    text = call.query.get("bbox", [""])[0]
    if not text:
        return None
    try:
        west, south, east, north = map(parse_number, text.split(","))
    except ValueError:
        raise UserError("bbox has four numbers: west,south,east,north, degrees") from None
    return west, south, east, north
