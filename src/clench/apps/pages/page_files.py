"""Check the file of a page before anything is loaded."""

from __future__ import annotations

from pathlib import Path

from clench.core.exceptions import FileError
from clench.core.files.json_files import check_writable


def check_page(path: Path, made: Path | None = None) -> None:
    """Refuse a file to which no page can be written, before anything is computed.

    Args:
        path: the file. made: a folder that will be made before the page is written.

    Raises:
        FileError: nothing can be written there, or its ending is not that of a page.
    """
    if path.suffix.lower() not in (".html", ".htm"):
        raise FileError(path, "expected a file name that ends with .html.")
    if made is None or path.parent != made:
        check_writable(path)
