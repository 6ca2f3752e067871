"""Make text from files safe to show: control characters for terminals are written out."""

from __future__ import annotations


def visible(text: str) -> str:
    r"""Return text in which every character can be seen: an escape becomes `\x1b`, a line break `\n`."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
