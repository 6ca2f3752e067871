"""Parts: the rows of a unit as the bytes of a Parquet file that describes its own content."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from clench.core.exceptions import FileError
from clench.core.files.file_limits import ARRAY_BYTES, DATASET_GROUP_ROWS, JSON_BYTES
from clench.core.files.json_files import parse_json

from .columns import SCHEMA, TEXTS, arrow_schema

if TYPE_CHECKING:
    import pyarrow.parquet

    from .rows import Row

#: Keys of the metadata of a file: schema, content, and the hands whose joints the rows have.
SCHEMA_KEY: Final = b"clench.schema"
CONTENT_KEY: Final = b"clench.content"
HANDS_KEY: Final = b"clench.hands"
#: Compression of rows; equal rows give equal bytes.
WRITING: Final[dict[str, Any]] = {"compression": "zstd", "compression_level": 3, "write_page_checksum": True}


def writing_options() -> dict[str, Any]:
    """Return the options of pyarrow's writer: dictionaries for text alone."""
    nested = [f"{name}.list.element" for name in TEXTS]
    return WRITING | {"use_dictionary": [*TEXTS, *nested]}


def with_metadata(content: Mapping[str, Any], hands: Mapping[str, Mapping[str, Any]]) -> pyarrow.Schema:
    """Return the schema with metadata.

    Args:
        content: description of the file. hands: names of the joints and links, by model.
    """
    return arrow_schema().with_metadata({SCHEMA_KEY: SCHEMA, CONTENT_KEY: _plain(content), HANDS_KEY: _plain(hands)})


def encode_part(rows: Sequence[Row], content: Mapping[str, Any], hands: Mapping[str, Mapping[str, Any]]) -> bytes:
    """Return rows as the bytes of a Parquet file; see `with_metadata`."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    buffer = io.BytesIO()
    pq.write_table(pa.Table.from_pylist(list(rows), with_metadata(content, hands)), buffer, **writing_options())
    return buffer.getvalue()


def open_parquet(source: Any, name: str) -> pyarrow.parquet.ParquetFile:
    """Return a Parquet file of grasps, whose columns and sizes were checked; its rows were not read.

    Args:
        source: bytes in memory, or a path. name: for messages.

    Raises:
        FileError: no Parquet file, of another schema, or larger than any that is written.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        file = pq.ParquetFile(
            source,
            thrift_string_size_limit=JSON_BYTES,
            thrift_container_size_limit=4 * ARRAY_BYTES // 1024,
            page_checksum_verification=True,
        )
        found = file.schema_arrow
        groups = [file.metadata.row_group(k) for k in range(file.metadata.num_row_groups)]
    except (pa.ArrowException, OSError, ValueError) as error:
        raise FileError(name, f"is no Parquet file that can be read ({' '.join(str(error).split())}).") from None
    said = (found.metadata or {}).get(SCHEMA_KEY, b"none").decode("utf-8", "replace")
    if said != SCHEMA:
        raise FileError(name, f"schema: expected '{SCHEMA}', got '{said}'.")
    if not found.remove_metadata().equals(arrow_schema()):
        missing = [column for column in arrow_schema().names if column not in found.names]
        what = f"lacks the columns {', '.join(missing)}" if missing else "has columns of other types"
        raise FileError(name, f"{what}; expected those of '{SCHEMA}' (docs/dataset.md).")
    for group in groups:
        largest = max((group.column(k).num_values for k in range(group.num_columns)), default=0)
        if group.num_rows > DATASET_GROUP_ROWS or max(group.total_byte_size, 8 * largest) > ARRAY_BYTES:
            raise FileError(name, f"has a group of {group.num_rows} rows, which is more than clench writes.")
    return file


def read_rows(file: pyarrow.parquet.ParquetFile, name: str) -> pyarrow.Table:
    """Return all rows of a part; the checksums of its pages must be right.

    Raises:
        FileError: they cannot be read.
    """
    import pyarrow as pa

    try:
        return file.read()
    except (pa.ArrowException, OSError, ValueError) as error:
        raise FileError(name, f"its rows cannot be read ({' '.join(str(error).split())}).") from None


def metadata_of(file: pyarrow.parquet.ParquetFile, key: bytes, name: str) -> dict[str, Any]:
    """Return a file's description of its content or of its hands.

    Raises:
        FileError: nothing, or no JSON object.
    """
    document = parse_json((file.schema_arrow.metadata or {}).get(key, b"null"), f"{name}: {key.decode()}")
    if not isinstance(document, dict):
        raise FileError(name, f"{key.decode()}: expected a JSON object.")
    return document


def sha256(content: bytes) -> str:
    """Return the SHA-256 of bytes, hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def _plain(document: Mapping[str, Any]) -> str:
    return json.dumps(document, allow_nan=False)
