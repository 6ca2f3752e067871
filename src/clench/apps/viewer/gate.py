"""The door in front of the viewer: it lets in the page itself, and from other machines only those with the token.

The web server behind it listens on a random address of this machine alone, and checks nothing. The door reads the head
of the first request of every connection, and passes bytes on if it is allowed:

- The `Host` names this machine, where only this machine may connect: another site that has its own name resolved to
  this machine is refused.
- The `Origin`, which browsers send with every websocket, is that of the page.
- With a token: the address has `?token=...` once; a cookie has it from then on.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import secrets
import socket
import threading
from dataclasses import dataclass
from typing import Final
from urllib.parse import parse_qs, urlsplit

from clench.core.exceptions import CommandError

#: Names of this machine that nothing but this machine reaches.
LOCAL: Final = ("localhost", "127.0.0.1", "::1")
_HEAD_BYTES: Final = 32_768
_HEAD_SECONDS: Final = 10.0
_CHUNK: Final = 1 << 16
#: What ends a connection early; the last one does when the door closes.
_BROKEN: Final = (asyncio.IncompleteReadError, asyncio.LimitOverrunError, asyncio.CancelledError)


@dataclass(frozen=True)
class Head:
    """The first lines of a request: its target, and its headers by name in lower case."""

    target: str
    headers: dict[str, str]


def new_token() -> str:
    """Return a token that nobody can guess."""
    return secrets.token_urlsafe(16)


def read_head(data: bytes) -> Head | None:
    """Return the target of a request, or None if it is no request."""
    lines = data.decode("latin-1").split("\r\n")
    words = lines[0].split(" ")
    if len(words) != 3 or words[0] != "GET" or not words[2].startswith("HTTP/1."):
        return None
    pairs = [line.partition(":") for line in lines[1:] if line]
    names = [name.strip().lower() for name, _, _ in pairs]
    if any(names.count(name) > 1 for name in ("host", "origin", "cookie")):
        return None
    headers = {name: value.strip() for name, (_, _, value) in zip(names, pairs, strict=True)}
    try:
        for address in (words[1], f"//{headers.get('host', '')}", headers.get("origin", "")):
            urlsplit(address)
    except ValueError:
        return None
    return Head(words[1], headers)


def refusal(head: Head, token: str | None, cookie: str) -> str:
    """Return why a request is refused; empty where it is let in.

    Args:
        head: of the request. token: None where only this machine can connect. cookie: the name of the token's cookie.
    """
    host = head.headers.get("host", "")
    if token is None and (urlsplit(f"//{host}").hostname or "") not in LOCAL:
        return "this page is for this machine only."
    origin = head.headers.get("origin")
    if origin is not None and urlsplit(origin).netloc != host:
        return "another page may not use this one."
    if token is not None and not (_same(_in_address(head), token) or _same(_in_cookie(head, cookie), token)):
        return "the address lacks the right token; open the one that clench view printed."
    return ""


def _in_address(head: Head) -> str:
    return parse_qs(urlsplit(head.target).query).get("token", [""])[0]


def _in_cookie(head: Head, cookie: str) -> str:
    pairs = (part.strip().partition("=") for part in head.headers.get("cookie", "").split(";"))
    return next((value for name, _, value in pairs if name == cookie), "")


def _same(given: str, token: str) -> bool:
    return hmac.compare_digest(given.encode(), token.encode())


class Gate:
    """Listen in front of a web server; see the module.

    Args:
        host, port: where to listen; port 0 takes any that is free. token: see `refusal`.

    Raises:
        CommandError: nothing can listen there.
    """

    def __init__(self, host: str, port: int, token: str | None) -> None:
        self._token = token
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        try:
            socket.getaddrinfo(host, None)
            self._socket = socket.create_server((host, port), family=family, backlog=64)
        except socket.gaierror:
            raise CommandError(f"--host: expected an address of this machine, got '{host}'.") from None
        except OverflowError:
            raise CommandError(f"--port: expected a number from 0 to 65535, got {port}.") from None
        except OSError as error:
            raise CommandError(
                f"--port {port}: nothing can listen there on {host} ({error.strerror}); choose another --port."
            ) from None
        self.port: int = self._socket.getsockname()[1]
        self._cookie = f"clench_token_{self.port}"
        self._upstream: tuple[str, int] = ("", 0)
        self._loop = asyncio.new_event_loop()
        self._thread: threading.Thread | None = None

    def open(self, upstream: tuple[str, int]) -> None:
        """Let connections through to a web server from now on."""
        self._upstream = upstream
        self._thread = threading.Thread(target=self._run, name="clench-gate", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop listening and end all connections."""
        if self._thread is None:
            self._socket.close()
            return
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        server = self._loop.run_until_complete(asyncio.start_server(self._serve, sock=self._socket, limit=_HEAD_BYTES))
        self._loop.run_forever()
        server.close()
        tasks = asyncio.all_tasks(self._loop)
        for task in tasks:
            task.cancel()
        self._loop.run_until_complete(asyncio.gather(*tasks, return_exceptions=True))
        self._loop.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(OSError, TimeoutError, *_BROKEN):
            data = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), _HEAD_SECONDS)
            answer = self._answer(data)
            if answer is None:
                await self._pass_on(data, reader, writer)
            else:
                writer.write(answer)
                await writer.drain()
        writer.close()

    def _answer(self, data: bytes) -> bytes | None:
        """Return the door's own answer, or None if the server behind it answers."""
        head = read_head(data)
        if head is None:
            return _response("400 Bad Request", "expected a request of a web page.")
        why = refusal(head, self._token, self._cookie)
        if why:
            return _response("403 Forbidden", why)
        if self._token is not None and _same(_in_address(head), self._token):
            cookie = f"{self._cookie}={self._token}; Path=/; HttpOnly; SameSite=Lax"
            return _response("303 See Other", "", f"Location: /\r\nSet-Cookie: {cookie}\r\n")
        return None

    async def _pass_on(self, data: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        behind, to_behind = await asyncio.open_connection(*self._upstream)
        to_behind.write(data)
        ways = [asyncio.create_task(_copy(reader, to_behind)), asyncio.create_task(_copy(behind, writer))]
        try:
            await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for way in ways:
                way.cancel()
            to_behind.close()


async def _copy(source: asyncio.StreamReader, target: asyncio.StreamWriter) -> None:
    with contextlib.suppress(OSError):
        while data := await source.read(_CHUNK):
            target.write(data)
            await target.drain()


def _response(status: str, sentence: str, more: str = "") -> bytes:
    body = f"clench view: {sentence}\n".encode() if sentence else b""
    head = f"HTTP/1.1 {status}\r\nContent-Type: text/plain; charset=utf-8\r\nContent-Length: {len(body)}\r\n"
    return f"{head}{more}Cache-Control: no-store\r\nConnection: close\r\n\r\n".encode() + body
