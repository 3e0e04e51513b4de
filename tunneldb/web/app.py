"""The application: routes of the desk."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.convertors import Convertor, register_url_convertor
from starlette.middleware import Middleware
from starlette.middleware.base import BaseHTTPMiddleware
from starlette.middleware.gzip import GZipMiddleware
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from tunneldb.web import (
    actions,
    exports,
    findings,
    health,
    ogc,
    photos,
    pictures,
    points,
    rating,
    sections,
    sign_in,
    surveys,
    tiles,
)
from tunneldb.web.config import Desk
from tunneldb.web.pages import FOLDER, STATIC, worker
from tunneldb.web.route import MAX_LARGE, route
from tunneldb.web.security import guard

SWEEP = 30.0
"""Time between two looks for sessions that are over, s."""


class _Key(Convertor[int]):
    """Key of a row in a path: at most 18 digits."""

    regex = "[0-9]{1,18}"

    def convert(self, value: str) -> int:
        return int(value)

    def to_string(self, value: int) -> str:
        return str(value)


register_url_convertor("key", _Key())


async def _end_idle(desk: Desk) -> None:
    """End sessions that are over, for ever."""
    while True:
        await asyncio.sleep(SWEEP)
        await run_in_threadpool(desk.sessions.end_idle)


def create_app(desk: Desk) -> Starlette:
    """Return the application of a desk."""

    @asynccontextmanager
    async def lifespan(app: Starlette) -> AsyncIterator[None]:
        timer = asyncio.create_task(_end_idle(desk))
        yield
        timer.cancel()
        desk.sessions.close()

    survey = "/api/surveys/{survey}"
    finding = "/api/findings/{id:key}"
    action = "/api/actions/{id:key}"
    tile = "/tiles/{survey}"
    app = Starlette(
        lifespan=lifespan,
        routes=[
            Route("/healthz", health.answer),
            Route("/", sign_in.page),
            Route("/worker.js", worker),
            Route("/open", sign_in.open_desk),
            Route("/enter", sign_in.enter),
            Route("/login", sign_in.form),
            Route("/login", sign_in.sign_in, methods=["POST"]),
            Route("/logout", route(sign_in.sign_out), methods=["POST"]),
            Route("/api/tunnels", route(surveys.tunnels)),
            Route("/api/surveys", route(surveys.list_all)),
            Route(survey, route(surveys.one)),
            Route(f"{survey}/summary", route(surveys.summary)),
            Route(f"{survey}/colours/{{kind}}", route(surveys.colours)),
            Route(f"{survey}/ribbon", route(surveys.ribbon)),
            Route(f"{survey}/section", route(sections.section, large=True)),
            Route(f"{survey}/section.dxf", route(sections.drawing, large=True)),
            Route(f"{survey}/points", route(points.points, large=True)),
            Route(f"{survey}/outlines", route(points.outlines)),
            Route(f"{survey}/export", route(exports.export)),
            Route(f"{survey}/rating/choices", route(rating.choices)),
            Route(f"{survey}/rating", route(rating.one)),
            Route(f"{survey}/rating/change", route(rating.change)),
            Route(f"{survey}/actions", route(actions.of_survey)),
            Route(f"{survey}/actions", route(actions.add), methods=["POST"]),
            Route(action, route(actions.change), methods=["PATCH"]),
            Route(action, route(actions.delete), methods=["DELETE"]),
            Route(f"{survey}/worklist", route(findings.worklist)),
            Route(f"{survey}/findings", route(findings.draw), methods=["POST"]),
            Route("/api/findings/merge", route(findings.merge), methods=["POST"]),
            Route(finding, route(findings.one)),
            Route(finding, route(findings.review), methods=["PATCH"]),
            Route(finding, route(findings.delete), methods=["DELETE"]),
            Route(f"{finding}/undo", route(findings.undo), methods=["POST"]),
            Route(f"{finding}/outline", route(findings.redraw), methods=["PUT"]),
            Route(f"{finding}/split", route(findings.split), methods=["POST"]),
            Route(f"{finding}/photos", pictures.add, methods=["POST"]),
            Route(f"{finding}/photos/{{photo:key}}", route(photos.change), methods=["PATCH"]),
            Route(f"{finding}/photos/{{photo:key}}", route(photos.delete), methods=["DELETE"]),
            Route("/photos/{id:key}", pictures.show),
            Route(f"{tile}/findings/{{z}}/{{x}}/{{y}}", route(tiles.vector_tile)),
            Route(f"{tile}/{{kind}}/{{z}}/{{x}}/{{y}}", route(tiles.image_tile)),
            Route("/tiles", route(ogc.tile_sets)),
            Route(f"{tile}/{{kind}}", route(ogc.tile_set)),
            Route("/tileMatrixSets", route(ogc.tile_matrix_sets)),
            Route("/tileMatrixSets/{name}", route(ogc.tile_matrix_set)),
            Route("/conformance", route(ogc.conformance)),
            Route("/collections", route(ogc.collections)),
            Route("/collections/{layer}", route(ogc.collection)),
            Route("/collections/{layer}/items", route(ogc.items)),
            Mount(STATIC, StaticFiles(directory=FOLDER / "static")),
        ],
        middleware=[
            Middleware(BaseHTTPMiddleware, dispatch=guard(desk.loopback, desk.secure)),
            Middleware(GZipMiddleware, minimum_size=1000),
        ],
    )
    app.state.desk = desk
    app.state.large = asyncio.Semaphore(MAX_LARGE)
    app.state.decoding = pictures.Decoding()
    app.state.health = health.Health(desk.dsn)
    return app
