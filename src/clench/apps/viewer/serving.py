"""Open the page: find a port, put the door in front, and say the address."""

from __future__ import annotations

import contextlib
import io
import secrets
import socket
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from clench.core.exceptions import ClenchError
from clench.core.extras import how_to_install

from .gate import LOCAL, Gate, new_token
from .grasps.listed_grasp import ListedGrasp
from .session.live_session import LiveSession
from .viewer_page import ViewerPage

if TYPE_CHECKING:
    import viser

DEFAULT_PORT: Final = 8765
_INSTALL: Final = f"clench view needs viser: {how_to_install('viewer')}."


@dataclass(frozen=True, eq=False)
class OpenPage:
    """A page that is being served.

    Args:
        url: address to open. server: viser's server. page: the page that it shows.
    """

    url: str
    server: viser.ViserServer
    page: ViewerPage


def check_viewer() -> None:
    """Refuse to go on without the package that serves the page.

    Raises:
        ClenchError: it is not installed.
    """
    import importlib.util

    if importlib.util.find_spec("viser") is None:
        raise ClenchError(_INSTALL)


@contextlib.contextmanager
def serve(
    session: LiveSession, host: str, port: int, grasps: Sequence[ListedGrasp] = (), dark: bool = False
) -> Iterator[OpenPage]:
    """Serve a session until the block ends.

    Args:
        session: the session to show. host, port: where to listen; for any host but this machine itself, the address
            has a token. grasps: a list to look through. dark: start dark.

    Raises:
        ClenchError: viser is not installed. CommandError: nothing can listen there.
    """
    check_viewer()
    import viser

    token = None if host in LOCAL else new_token()
    gate = Gate(host, port, token)
    inner = _inner_address()
    with contextlib.redirect_stdout(io.StringIO()):  # it would print the inner address
        server = viser.ViserServer(host=inner, port=0, label="clench view", verbose=False)
    try:
        page = ViewerPage(server, session, grasps, dark)
        session.begin(page)
        gate.open((inner, server.get_port()))
        # An address that listens on all networks is none that others can open.
        shown = socket.gethostname() if host in ("0.0.0.0", "::") else host
        name = f"[{shown}]" if ":" in shown else shown
        path = f"/?token={token}" if token else ""
        yield OpenPage(f"http://{name}:{gate.port}{path}", server, page)
    finally:
        gate.close()
        session.close()
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()


def _inner_address() -> str:
    """Return an address that only this machine has; on Linux one of 16 million, which no web page can guess."""
    if sys.platform != "linux":
        return "127.0.0.1"
    a, b, c = (1 + secrets.randbelow(254) for _ in range(3))
    return f"127.{a}.{b}.{c}"
