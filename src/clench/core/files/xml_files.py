"""Read XML files: URDF and MJCF."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

from clench.core.exceptions import FileError

from .file_bytes import read_file
from .file_limits import MODEL_BYTES, XML_DEPTH, XML_ELEMENTS


def read_xml(path: Path, expected: str) -> tuple[ET.Element, int]:
    """Return the root of an XML file, and the size of the file [bytes].

    Entities of other files are never read; the parser refuses entities that grow.

    Args:
        path: the file. expected: expected kind of the file, for messages.

    Raises:
        FileError: missing, unreadable, too large, not XML, or with too many elements or levels of them.
    """
    data = read_file(path, MODEL_BYTES)
    return parse_xml(data, path, expected), len(data)


def parse_xml(data: bytes, source: str | Path, expected: str) -> ET.Element:
    """Return the root of XML text; `source` names it in messages.

    Raises:
        FileError: see `read_xml`.
    """
    try:
        root = ET.fromstring(data)
    except (ET.ParseError, ValueError, LookupError) as error:
        raise FileError(source, f"not well-formed XML ({error}); expected {expected}.") from None
    check_xml(root, source)
    return root


def check_xml(root: ET.Element, source: str | Path) -> None:
    """Refuse a tree of too many elements or levels.

    Raises:
        FileError: with the limit.
    """
    level, count = [root], 1
    for _ in range(XML_DEPTH):
        level = [child for element in level for child in element]
        count += len(level)
        if count > XML_ELEMENTS:
            raise FileError(source, f"has more than {XML_ELEMENTS} elements, far more than a hand needs.")
        if not level:
            return
    raise FileError(source, f"has more than {XML_DEPTH} elements inside each other, far more than a hand needs.")
