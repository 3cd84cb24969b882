"""A static server below a path, as a school has one: it counts what it sends, and breaks off when a test says so."""

import contextlib
import gzip
import http.server
import threading
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from browser import free_port

BELOW = "/school/laboratory/"  #: the folder's path on the server


@dataclass
class Static:
    """A static server that runs.

    Attributes
    ----------
    address : of its folder
    folders : name below the address → folder; "" is that of all other names
    cut : end of a path → bytes after which its connection breaks, each time until it is taken out
    held : end of a path → event for which its second half waits
    before : end of a path → bytes that are put before the file
    sent : path → bytes of the bodies that were sent
    """

    address: str
    folders: Mapping[str, Path]
    cut: dict[str, int] = field(default_factory=dict)
    held: dict[str, threading.Event] = field(default_factory=dict)
    before: dict[str, bytes] = field(default_factory=dict)
    sent: dict[str, int] = field(default_factory=dict)

    def file(self, path: str) -> Path:
        """Find the file of a path below the address."""
        name, _slash, rest = path.partition("/")
        found = self.folders[name] / rest if name in self.folders else self.folders[""] / path
        return found / "index.html" if found.is_dir() else found

    def gzipped(self) -> int:
        """Count the bytes of all that was sent, if the server packed it as usual servers do."""
        return sum(len(gzip.compress(self.file(path).read_bytes(), 6)) for path in self.sent)


@contextlib.contextmanager
def static(folders: Mapping[str, Path], others: Mapping[str, str] = {}) -> Iterator[Static]:
    """Serve folders until the block ends; every file is of a kind that says nothing, but for pages, styles, scripts.

    ``others``: the kinds of other files, by their ending.
    """
    port = free_port()
    served = Static(f"http://127.0.0.1:{port}{BELOW}", folders)

    class Handler(http.server.BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def log_message(self, *_: Any) -> None:
            pass

        def do_GET(self) -> None:
            path = self.path.partition("?")[0].removeprefix(BELOW)
            file = served.file(path)
            if not self.path.startswith(BELOW) or not file.is_file():
                self.send_error(404)
                return
            kinds = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", **others}
            body = _of(served.before, path, b"") + file.read_bytes()
            self.send_response(200)
            self.send_header("Content-Type", kinds.get(file.suffix, "application/octet-stream"))
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            after = _of(served.cut, path, None)
            if after is not None:
                self.wfile.write(body[:after])
                self.close_connection = True
                return
            half = len(body) // 2
            with contextlib.suppress(OSError):  # nobody waits for it any more
                self.wfile.write(body[:half])
                if (event := _of(served.held, path, None)) is not None:
                    self.wfile.flush()
                    event.wait(60)
                self.wfile.write(body[half:])
            served.sent[path] = served.sent.get(path, 0) + len(body)

    server = http.server.ThreadingHTTPServer(("127.0.0.1", port), Handler)
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield served
    finally:
        for event in served.held.values():
            event.set()
        server.shutdown()
        server.server_close()
        thread.join()


def _of(by_end: Mapping[str, Any], path: str, otherwise: Any) -> Any:
    return next((value for end, value in by_end.items() if path.endswith(end)), otherwise)
