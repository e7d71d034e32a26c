"""The built-in page: a web server on loopback that hands out frames as they come (server-sent events)."""

from __future__ import annotations

import json
import re
import sys
import threading
from collections import deque
from html import escape
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, Final

from cablecomp.monitor.frames import Frame

_KEPT: Final = 3_000
_HERE: Final = ("127.0.0.1", "localhost", "[::1]")
"""Names of this machine: a page from elsewhere whose name was bent to it (DNS rebinding) asks by its own."""
_PAGE: Final = Path(__file__).parent / "page.html"


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that has gone, at whatever moment, is no error; all else is told as ever."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


class PageServer:
    """Serves the page at `address` until it is closed; keeps the last frames for those who come late.

    A browser that is slow misses frames; nobody waits for it.
    """

    def __init__(self, title: str, styles: str, port: int = 0) -> None:
        self._frames: deque[tuple[int, str]] = deque(maxlen=_KEPT)
        self._count, self._over = 0, False
        self._news = threading.Condition()
        html = (
            _PAGE.read_text(encoding="utf-8").replace("TITLE", escape(title)).replace("/* STYLES */", styles)
        )
        self._html = html.encode()
        self._server = _Server(("127.0.0.1", port), self._handler())
        self._thread = threading.Thread(
            target=self._server.serve_forever, args=(0.1,), name="page", daemon=True
        )
        self._thread.start()

    @property
    def address(self) -> str:
        """Where a browser finds the page."""
        return f"http://127.0.0.1:{self._server.server_port}/"

    def take(self, found: Frame) -> None:
        """Give a frame to everyone who looks on."""
        text = json.dumps(found)
        with self._news:
            self._count += 1
            self._frames.append((self._count, text))
            self._news.notify_all()

    def finish(self) -> None:
        """Say that no more frames come; the page stays."""
        with self._news:
            self._over = True
            self._news.notify_all()

    def close(self) -> None:
        """End every stream and the server."""
        self.finish()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def after(self, number: int) -> list[tuple[int, str]] | None:
        """Frames after one of that number, waiting for the next if there are none; None when it is over."""
        with self._news:
            self._news.wait_for(lambda: self._over or self._count > number, timeout=5.0)
            found = [pair for pair in self._frames if pair[0] > number]
            return None if self._over and not found else found

    def _handler(self) -> type[BaseHTTPRequestHandler]:
        server = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                host = self.headers.get("Host", _HERE[0])
                if re.sub(r":\d*$", "", host).lower() not in _HERE:
                    self.send_error(403, f"only for {', '.join(_HERE)}")
                elif self.path == "/":
                    self._head("text/html; charset=utf-8", len(server._html))
                    self.wfile.write(server._html)
                elif self.path == "/events":
                    self._head("text/event-stream")
                    self._stream()
                else:
                    self.send_error(404)

            def _head(self, kind: str, length: int | None = None) -> None:
                self.send_response(200)
                self.send_header("Content-Type", kind)
                self.send_header("Cache-Control", "no-store")
                if length is not None:
                    self.send_header("Content-Length", str(length))
                self.end_headers()

            def _stream(self) -> None:
                number = 0
                while (found := server.after(number)) is not None:
                    for _, text in found:
                        self.wfile.write(f"data: {text}\n\n".encode())
                    number = found[-1][0] if found else number
                    self.wfile.write(b": still here\n\n")
                    self.wfile.flush()
                self.wfile.write(b"event: over\ndata: {}\n\n")

            def log_message(self, *words: Any) -> None:
                """Nothing: the terminal belongs to the run."""

        return Handler
