"""Say in one sentence, which begins with the key, why a document does not have its form."""

from __future__ import annotations

import re
from typing import Final

import msgspec

_UNKNOWN: Final = re.compile(r"Object contains unknown field '(.+)'$")
_MISSING: Final = re.compile(r"Object missing required field '(.+)'$")


def form_sentence(error: msgspec.ValidationError, form: type[msgspec.Struct]) -> str:
    """Return a sentence about a wrong value.

    Args:
        error: of `msgspec.convert`. form: of the whole document; its keys are listed after an unknown one.
    """
    text, _, place = str(error).replace("`", "'").partition(" - at '$")
    place = place.rstrip("'").lstrip(".")
    start = f"{place}." if place else ""
    unknown, missing = _UNKNOWN.match(text), _MISSING.match(text)
    if unknown:
        known = "" if place else f"; expected one of {', '.join(form.__struct_encode_fields__)}"
        return f"{start}{unknown[1]}: unknown key{known}."
    if missing:
        return f"{start}{missing[1]}: missing."
    return f"{place or 'document'}: {text[:1].lower()}{text[1:].replace(chr(39), '')}."
