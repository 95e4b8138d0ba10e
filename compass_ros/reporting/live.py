"""The report of a folder, served to this machine's browsers while a calibration writes it.

Three files and no others, to this machine alone: requests that name another host (a page elsewhere whose name was made
to point here) are refused, nothing is allowed to other origins, and nothing can be written.
"""

from __future__ import annotations

import json
import math
import threading
import time
from dataclasses import dataclass
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import TracebackType
from urllib.parse import urlsplit

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from compass_ros.errors import ConfigError
from compass_ros.reporting.report import content_hash, style, template_text
from compass_ros.types import Progress, Report

HOST = "127.0.0.1"
FILES = {"/report.html": "text/html; charset=utf-8", "/result.json": "application/json"}
"""What is served of the folder."""
WATCHED_S, LAST_S = 6.0, 5.0
"""A browser that asked so lately is waited for so long at the end, until it has the last report [s]."""
POLICY = "default-src 'none'; frame-src 'self'; connect-src 'self'; img-src data:; style-src 'unsafe-inline';"


@dataclass
class _State:
    stage: str
    done: float = math.nan
    gap: float = math.nan
    ended: bool = False


class LiveReport:
    """A server in a thread of its own, from `with` to its end. Raises ConfigError where the port cannot be had."""

    def __init__(self, folder: Path, port: int, computing: bool) -> None:
        """`computing`: this process computes what is shown, and an earlier result in the folder is not meant."""
        self.folder = folder.absolute()
        self._state = _State("begins" if computing else "watching this folder")
        self._before = self._version() if computing else None
        self._begun = time.monotonic() if computing else math.nan
        self._asked_at, self._served, self._fetched = -math.inf, "", threading.Event()
        try:
            self._server = ThreadingHTTPServer((HOST, port), _handler(self))
        except OSError as error:
            raise ConfigError(f"port {port}: cannot be served: {error.strerror}") from error
        self._server.daemon_threads = True
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.1,), daemon=True)

    @property
    def port(self) -> int:
        return int(self._server.server_address[1])

    @property
    def address(self) -> str:
        return f"http://localhost:{self.port}/"

    def __enter__(self) -> LiveReport:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """A browser that watches gets the last report, if all went well."""
        if kind is None and self._state.ended and time.monotonic() - self._asked_at < WATCHED_S:
            self._fetched.wait(LAST_S)
        self._server.shutdown()
        self._server.server_close()

    def beside(self, report: Report) -> Report:
        """A `Report` that is shown here too."""

        def told(progress: Progress) -> bool:
            self._state = _State(progress.stage, progress.done, progress.gap)
            return report(progress)

        return told

    def end(self) -> None:
        """All is written."""
        self._state = _State("done", 1.0, ended=True)

    def wait(self) -> None:
        """Serve until the process is interrupted."""
        self._thread.join()

    def state(self) -> dict[str, object]:
        """What the page asks for."""
        self._asked_at, now, version = time.monotonic(), self._state, self._shown()
        if now.ended and version == self._served:
            self._fetched.set()
        said = {"done": now.done, "gap": now.gap, "elapsed_s": self._asked_at - self._begun}
        numbers = {name: value if math.isfinite(value) else None for name, value in said.items()}
        return {"stage": now.stage, "ended": now.ended, "report": version, **numbers}

    def read(self, path: str) -> tuple[bytes, str] | None:
        """One of the files and the version that it is at least of; None where it is not there (yet)."""
        version = self._shown()
        if path not in FILES or version is None:
            return None
        try:
            return (self.folder / path[1:]).read_bytes(), version
        except OSError:
            return None

    def delivered(self, path: str, version: str) -> None:
        """A browser has all of this file: only now may the process end."""
        if path == "/report.html":
            self._served = version
            if self._state.ended and version == self._shown():
                self._fetched.set()

    def _version(self) -> str | None:
        """Of the report in the folder; result.json is written after it."""
        try:
            return str((self.folder / "result.json").stat().st_mtime_ns)
        except OSError:
            return None

    def _shown(self) -> str | None:
        now = self._version()
        return None if now == self._before else now


def live_page(folder: Path) -> str:
    environment = Environment(loader=PackageLoader("compass_ros.reporting"), autoescape=True, undefined=StrictUndefined)
    script = template_text("live.js").strip()
    return environment.get_template("live.html.j2").render(
        folder=folder.name,
        policy=f"{POLICY} script-src {content_hash(script)}",
        style=Markup(style()),
        script=Markup(script),
    )


def _handler(live: LiveReport) -> type[BaseHTTPRequestHandler]:
    page = live_page(live.folder).encode()

    class Handler(BaseHTTPRequestHandler):
        timeout = 10.0
        server_version, sys_version = "compass", ""

        def do_GET(self) -> None:
            if self.headers.get("Host") not in {f"{host}:{live.port}" for host in ("localhost", HOST)}:
                self._answer(HTTPStatus.FORBIDDEN, "text/plain", b"this page is served to localhost\n")
                return
            path = urlsplit(self.path).path
            if path == "/":
                self._answer(HTTPStatus.OK, "text/html; charset=utf-8", page)
            elif path == "/state.json":
                self._answer(HTTPStatus.OK, "application/json", json.dumps(live.state()).encode())
            elif (read := live.read(path)) is not None:
                content, version = read
                self._answer(HTTPStatus.OK, FILES[path], content)
                if self.command == "GET":
                    live.delivered(path, version)
            else:
                self._answer(HTTPStatus.NOT_FOUND, "text/plain", b"not here\n")

        do_HEAD = do_GET  # noqa: N815

        def _answer(self, status: HTTPStatus, kind: str, content: bytes) -> None:
            self.send_response(status)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(content)))
            for name, value in (
                ("Cache-Control", "no-store"),
                ("X-Content-Type-Options", "nosniff"),
                ("X-Frame-Options", "SAMEORIGIN"),
                ("Cross-Origin-Resource-Policy", "same-origin"),
                ("Referrer-Policy", "no-referrer"),
            ):
                self.send_header(name, value)
            self.end_headers()
            if self.command != "HEAD":
                self.wfile.write(content)

        def log_message(self, *args: object) -> None:
            """Nothing on standard error."""

    return Handler
