"""The rig by HTTP: students send runs, the worker fetches them, the laboratory has a page."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from labcourse.grading.scoring.guards import Site
from rotflex.errors import BenchError
from rotflex_rig import request as runs
from rotflex_rig.queue import LABORATORY, STUDENT, WORKER, Queue, Refused

_PAGE = Path(__file__).parent / "page"
_MOST_RECORDING = 20_000_000  # bytes, from the worker
_DRAWN = 200  # points of a curve on the page
_Answer = Callable[[str, Request, bytes], Any]


def application(queue: Queue, site: Site) -> Starlette:
    """Return the server of a rig at a site."""

    def route(path: str, method: str, answer: _Answer, *roles: str, most: int = runs.MOST_BYTES) -> Route:
        """Return a route for the owners of some tokens, with a body of bounded size."""

        async def endpoint(request: Request) -> Response:
            site.check_host(request)
            who = queue.who(request.headers.get("authorization", "").removeprefix("Bearer "), *roles)
            body = bytearray()
            async for chunk in request.stream():
                body += chunk
                if len(body) > most:
                    raise Refused(413, f"This is too large; at most {most / 1e6:g} MB are taken.")
            said = answer(who, request, bytes(body))
            return said if isinstance(said, Response) else JSONResponse(said)

        return Route(path, endpoint, methods=[method])

    def put(who: str, _request: Request, body: bytes) -> dict[str, int]:
        asked = runs.read(body)
        return {"id": queue.put(who, body, asked.settings["experiment"], asked.seconds)}

    def recording(who: str, request: Request, _body: bytes) -> Response:
        return Response(queue.recording(who, number(request)))

    def take(who: str, request: Request, body: bytes) -> dict[str, Any]:
        run = queue.take(f"{who} {request.path_params['worker']}", json.loads(body))
        return {} if run is None else {"id": run["id"], "body": run["body"].decode()}

    def finish(who: str, request: Request, body: bytes) -> None:
        outcome = json.loads(body) if body.startswith(b"{") else body
        queue.finish(f"{who} {request.path_params['worker']}", number(request), outcome)

    def control(who: str, _request: Request, body: bytes) -> dict[str, Any]:
        said = json.loads(body)
        if "present" in said:
            queue.confirm_presence(bool(said["present"]))
        else:
            queue.pause(f"{who} paused it" if said["pause"] else "")
        return queue.overview()

    def number(request: Request) -> int:
        return int(request.path_params["id"])

    routes = [
        route("/me", "GET", lambda who, _request, _body: {"id": who}, STUDENT, LABORATORY, WORKER),
        route("/bench", "GET", lambda *_: queue.bench(), STUDENT),
        route("/runs", "POST", put, STUDENT),
        route("/runs/{id:int}", "GET", lambda who, request, _: queue.status(who, number(request)), STUDENT),
        route("/runs/{id:int}", "DELETE", lambda who, request, _: queue.let_go(who, number(request)), STUDENT),
        route("/runs/{id:int}/recording", "GET", recording, STUDENT),
        route("/worker/{worker}", "POST", take, WORKER),
        route("/worker/{worker}/{id:int}", "GET", lambda _who, r, _: queue.is_wanted(number(r)), WORKER),
        route("/worker/{worker}/{id:int}", "PUT", finish, WORKER, most=_MOST_RECORDING),
        route("/queue", "GET", lambda *_: queue.overview(), LABORATORY),
        route("/control", "POST", control, LABORATORY),
        route("/curves/{id:int}", "GET", lambda _who, r, _: _curves(queue.recording_file(number(r))), LABORATORY),
    ]
    return Starlette(
        routes=[*routes, Mount("/", StaticFiles(directory=_PAGE, html=True))], exception_handlers={BenchError: _refusal}
    )


def _refusal(_request: Request, error: Exception) -> Response:
    return PlainTextResponse(str(error), getattr(error, "status", 422))


def _curves(path: Path) -> dict[str, Any]:
    """Return a few points of a recording: t (s), and its angles in degrees."""
    recording = runs.recording_of_bytes(path.read_bytes())
    every = max(len(recording) // _DRAWN, 1)
    names = [name for name in ("theta_ref", "theta", "alpha") if name in recording]
    curves = {name: recording.degrees(name)[::every].round(2).tolist() for name in names}
    return {"t": recording.time[::every].round(3).tolist(), "curves": curves}
