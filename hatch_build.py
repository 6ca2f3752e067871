"""The README as a package index shows it: its links are absolute, or plain text while the project has no address."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

IMAGE = re.compile(r"^!\[[^\]]*\]\((?!https?://)([^)]+)\)\n\n?", re.MULTILINE)
LINK = re.compile(r"(?<!!)\[([^\]]*)\]\((?!https?://|#)([^)]+)\)")


class ReadmeHook(MetadataHookInterface):
    """Write the field `readme`; pyproject.toml sets the addresses."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Set the README of the package."""
        text = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        text = packaged(text, self.config.get("files", ""), self.config.get("images", ""))
        metadata["readme"] = {"content-type": "text/markdown", "text": text}


def packaged(text: str, files: str, images: str) -> str:
    """Return a README without relative links.

    Args:
        text: the README of the repository.
        files: address that relative links count from; without it, a link becomes its text.
        images: address that pictures count from; without it, they are left out.
    """
    text = IMAGE.sub(lambda found: found[0].replace(f"({found[1]})", f"({images}{found[1]})") if images else "", text)
    return LINK.sub(lambda found: f"[{found[1]}]({files}{found[2]})" if files else found[1], text)
