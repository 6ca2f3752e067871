"""Who gets through the door in front of the page."""

from __future__ import annotations

import http.client
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest

from clench import CommandError
from clench.apps.viewer.gate import Gate, new_token, read_head


class Behind(BaseHTTPRequestHandler):
    """A web server that answers everybody."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Length", "6")
        self.end_headers()
        self.wfile.write(b"inside")

    def log_message(self, *_: object) -> None:
        """Say nothing."""


@contextmanager
def gate_before(token: str | None) -> Iterator[Gate]:
    behind = HTTPServer(("127.0.0.1", 0), Behind)
    threading.Thread(target=behind.serve_forever, daemon=True).start()
    gate = Gate("127.0.0.1", 0, token)
    gate.open(("127.0.0.1", behind.server_port))
    try:
        yield gate
    finally:
        gate.close()
        behind.shutdown()
        behind.server_close()


def ask(gate: Gate, path: str = "/", **headers: str) -> http.client.HTTPResponse:
    connection = http.client.HTTPConnection("127.0.0.1", gate.port, timeout=10.0)
    connection.request("GET", path, headers=headers)
    return connection.getresponse()


def test_this_machine_gets_in_without_a_token() -> None:
    with gate_before(None) as gate:
        assert ask(gate).read() == b"inside"
        assert ask(gate, Host=f"localhost:{gate.port}", Origin=f"http://localhost:{gate.port}").status == 200


def test_another_name_for_this_machine_is_refused() -> None:
    """A page of another site could have its own name lead here."""
    with gate_before(None) as gate:
        answer = ask(gate, Host=f"evil.example:{gate.port}")
        assert answer.status == 403
        assert b"this machine only" in answer.read()


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://localhost:1"])
def test_another_page_cannot_connect(origin: str) -> None:
    with gate_before(None) as gate:
        answer = ask(gate, Host=f"localhost:{gate.port}", Origin=origin, Upgrade="websocket", Connection="Upgrade")
        assert answer.status == 403


def test_the_token_is_needed_once_and_then_the_cookie() -> None:
    token = new_token()
    with gate_before(token) as gate:
        assert ask(gate).status == 403
        assert ask(gate, "/?token=wrong").status == 403
        assert ask(gate, "/?token=").status == 403
        let_in = ask(gate, f"/?token={token}")
        assert let_in.status == 303
        assert let_in.getheader("Location") == "/"
        cookie = (let_in.getheader("Set-Cookie") or "").split(";")[0]
        assert ask(gate, Cookie=cookie).read() == b"inside"
        assert ask(gate, Cookie=cookie[:-1]).status == 403
        assert ask(gate, Cookie=cookie, Origin="http://evil.example").status == 403


def test_what_is_no_request_is_refused() -> None:
    with gate_before(None) as gate, socket.create_connection(("127.0.0.1", gate.port), timeout=10.0) as line:
        line.sendall(b"POST / HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert line.recv(1000).startswith(b"HTTP/1.1 400")


def test_a_header_that_comes_twice_is_refused() -> None:
    assert read_head(b"GET / HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n\r\n") is None


def test_a_port_in_use_is_one_sentence() -> None:
    with gate_before(None) as gate, pytest.raises(CommandError, match=f"--port {gate.port}: nothing can listen there"):
        Gate("127.0.0.1", gate.port, None)


def test_a_port_that_is_none_is_one_sentence() -> None:
    with pytest.raises(CommandError, match=r"^--port: expected a number from 0 to 65535, got 99999\.$"):
        Gate("127.0.0.1", 99999, None)
    with pytest.raises(CommandError, match=r"^--host: expected an address of this machine, got 'no such host'\.$"):
        Gate("no such host", 0, None)


@pytest.mark.parametrize(
    "lines", ["GET / HTTP/1.1\r\nHost: [", "GET / HTTP/1.1\r\nOrigin: http://[", "GET //[?token=1 HTTP/1.1"]
)
def test_an_address_that_is_none_is_no_request(lines: str) -> None:
    assert read_head(f"{lines}\r\n\r\n".encode()) is None
    assert read_head(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n") is not None
