"""The application: routes of the desk."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import psycopg
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.middleware import Middleware
from starlette.middleware.base import BaseHTTPMiddleware
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from tunneldb.errors import UserError
from tunneldb.web import exports, findings, ogc, sign_in, surveys, tiles
from tunneldb.web.config import Desk
from tunneldb.web.pages import FOLDER
from tunneldb.web.route import route
from tunneldb.web.security import guard
from tunneldb.web.sessions import open_own


async def health(request: Request) -> Response:
    """Return 200 if the database answers, else 503."""

    def ask() -> bool:
        try:
            with open_own(request.app.state.desk.dsn) as conn:
                return conn.execute("SELECT 1").fetchone() == (1,)
        except (UserError, psycopg.Error):
            return False

    return PlainTextResponse("ok") if await run_in_threadpool(ask) else PlainTextResponse("no database", 503)


def create_app(desk: Desk) -> Starlette:
    """Return the application of a desk."""

    @asynccontextmanager
    async def lifespan(app: Starlette) -> AsyncIterator[None]:
        yield
        desk.sessions.close()

    survey = "/api/surveys/{survey}"
    finding = "/api/findings/{id:int}"
    tile = "/tiles/{survey}"
    app = Starlette(
        lifespan=lifespan,
        routes=[
            Route("/healthz", health),
            Route("/", sign_in.page),
            Route("/enter", sign_in.enter),
            Route("/login", sign_in.form),
            Route("/login", sign_in.sign_in, methods=["POST"]),
            Route("/logout", route(sign_in.sign_out), methods=["POST"]),
            Route("/api/surveys", route(surveys.list_all)),
            Route(survey, route(surveys.one)),
            Route(f"{survey}/ribbon", route(surveys.ribbon)),
            Route(f"{survey}/section", route(surveys.section)),
            Route(f"{survey}/export", route(exports.export)),
            Route(f"{survey}/worklist", route(findings.worklist)),
            Route(f"{survey}/findings", route(findings.draw), methods=["POST"]),
            Route("/api/findings/merge", route(findings.merge), methods=["POST"]),
            Route(finding, route(findings.one)),
            Route(finding, route(findings.review), methods=["PATCH"]),
            Route(finding, route(findings.delete), methods=["DELETE"]),
            Route(f"{finding}/undo", route(findings.undo), methods=["POST"]),
            Route(f"{finding}/outline", route(findings.redraw), methods=["PUT"]),
            Route(f"{finding}/split", route(findings.split), methods=["POST"]),
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
            Mount("/static", StaticFiles(directory=FOLDER / "static")),
        ],
        middleware=[
            Middleware(BaseHTTPMiddleware, dispatch=guard(desk.loopback)),
            Middleware(GZipMiddleware, minimum_size=1000),
        ],
    )
    app.state.desk = desk
    return app
