"""What is said of a document that does not have its form: the key, and what was expected there."""

from __future__ import annotations

import msgspec
import pytest

from clench.core.files.form_errors import form_sentence


class Part(msgspec.Struct, forbid_unknown_fields=True):
    """A part of a document."""

    size: float


class Document(msgspec.Struct, forbid_unknown_fields=True):
    """A document."""

    name: str
    parts: list[Part] = []


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        ({"name": "a", "nme": 1}, "nme: unknown key; expected one of name, parts."),
        ({"name": "a", "parts": [{"size": 1.0, "x": 1}]}, "parts[0].x: unknown key."),
        ({}, "name: missing."),
        ({"name": "a", "parts": [{"size": 1.0}, {}]}, "parts[1].size: missing."),
        ({"name": 3}, "name: expected str, got int."),
        ({"name": "a", "parts": [{"size": "b"}]}, "parts[0].size: expected float, got str."),
        ([], "document: expected object, got array."),
    ],
)
def test_the_sentence_begins_with_the_key(data: object, sentence: str) -> None:
    with pytest.raises(msgspec.ValidationError) as caught:
        msgspec.convert(data, Document)
    assert form_sentence(caught.value, Document) == sentence
