"""Read YAML files: plain values only, and no more of them than the file has room for."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

from clench.core.exceptions import FileError

from .file_bytes import read_text
from .file_limits import DOCUMENT_DEPTH, DOCUMENT_VALUES, LINE_BYTES, YAML_BYTES
from .nesting import TOO_DEEP

#: A value takes at most so many events of the parser, its start and its end.
_EVENTS: Final = 2


def read_yaml(path: str | Path) -> Any:
    """Return the content of a YAML file.

    Raises:
        FileError: missing, unreadable, too large, not YAML, or with aliases that stand for too many values.
    """
    import yaml

    text = read_text(path, YAML_BYTES)
    reader = yaml.CSafeLoader if yaml.__with_libyaml__ else yaml.SafeLoader
    loader = reader(text)
    try:
        _check_depth(yaml.parse(text, Loader=reader), path)
        node = loader.get_single_node()
        if node is None:
            return None
        _check_size(node, path)
        return loader.construct_document(node)
    except yaml.YAMLError as error:
        raise FileError(path, f"not YAML ({' '.join(str(error).split())}).") from None
    except ValueError as error:
        if isinstance(error, FileError):
            raise
        raise FileError(path, f"not YAML that can be read: {error}.") from None  # dates and numbers that are none
    finally:
        loader.dispose()


def _check_depth(events: Iterable[Any], path: str | Path) -> None:
    """Refuse deep nesting and long values before any reader walks through them."""
    import yaml

    depth = 0
    for count, event in enumerate(events):
        if count > _EVENTS * DOCUMENT_VALUES:
            raise FileError(path, f"not YAML that can be read: it has more than {DOCUMENT_VALUES} values.")
        if isinstance(event, yaml.ScalarEvent) and len(event.value) > LINE_BYTES:
            raise FileError(path, f"not YAML that can be read: a value has more than {LINE_BYTES} characters.")
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
            if depth > DOCUMENT_DEPTH:
                raise FileError(path, f"not YAML that can be read: {TOO_DEEP}.")
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1


def _check_size(root: Any, path: str | Path) -> None:
    """Refuse aliases that stand for themselves, or for more values than are read."""
    import yaml

    sizes: dict[int, int] = {}
    open_nodes: set[int] = set()

    def size(node: Any) -> int:
        if isinstance(node, yaml.ScalarNode):
            return 1
        if id(node) in open_nodes:
            raise FileError(path, "not YAML that can be read: a value has an alias of itself inside.")
        if id(node) not in sizes:
            open_nodes.add(id(node))
            parts = (
                node.value if isinstance(node, yaml.SequenceNode) else [part for pair in node.value for part in pair]
            )
            sizes[id(node)] = 1 + sum(map(size, parts))
            open_nodes.discard(id(node))
        return sizes[id(node)]

    if size(root) > DOCUMENT_VALUES:
        raise FileError(path, f"not YAML that can be read: its aliases stand for more than {DOCUMENT_VALUES} values.")
