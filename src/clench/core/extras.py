"""How to install what clench needs for some tasks only."""

from __future__ import annotations


def how_to_install(extra: str) -> str:
    """Return the commands that install an extra: beside the package, and in a checkout."""
    return f"pip install 'clench[{extra}]' (in a checkout: uv sync --no-dev --inexact --extra {extra})"
