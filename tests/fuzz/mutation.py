"""Ways to spoil a good input, reproducible from a random generator."""

import json
import re
from typing import Any

import numpy as np

Rng = np.random.Generator

#: Numbers as text that readers stumble over.
NUMBERS = (
    *(
        "nan",
        "inf",
        "-inf",
        "NaN",
        "Infinity",
        "1e308",
        "-1e308",
        "1e400",
        "1e-320",
        "5e-324",
        "0",
        "-0",
        "-1",
        "1e-12",
    ),
    *("1e12", "99999999999999999999", "0x10", "1,5", "", "1e", "٣", "1_000", "--1", "null", "true", "3.14", "1e-3"),
)
#: Text where a name or a path belongs.
TEXTS = (
    *(
        "",
        " ",
        "\0",
        "\n",
        "../..",
        "/",
        "~",
        "a" * 5000,
        "name with spaces",
        "é",
        "日本語",
        "‮",
        "😀",
        "%s%n",
        "${x}",
        "[bold]",
    ),
    *(
        "con",
        ".",
        "..",
        "palm",
        "index",
        "index_0",
        "world",
        "package://x/y",
        "file:///etc",
        "nan",
        "1",
        "<a>",
        "'",
        '"',
        "\\",
    ),
)
#: Values of JSON and TOML, and of arguments.
VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1, 2, 10**6, 10**30, -(10**30), 0.0, -0.0, 1e308, -1e308, 5e-324, 1e-12, 0.1, 1e12),
    *(
        float("nan"),
        float("inf"),
        float("-inf"),
        "",
        "x",
        "nan",
        "1",
        [],
        [0],
        [1, 2],
        [0.0] * 3,
        [1.0] * 4,
        {},
        {"a": 1},
    ),
    *([float("nan")] * 3, [[1.0, 0.0, 0.0]], "é" * 300, [None], {"position": [0, 0, 0]}, {"": None}, [1e308] * 3),
)
#: Share of spoiled texts in which only values are changed.
PARSED = 0.75
_SIGNS = ("<", ">", "/>", "{", "}", "[", "]", "[" * 100_000, "=", "#", "&amp;", "&x;")
_NUMBER = re.compile(r"(?<![\w.])-?\d+\.?\d*(?:[eE][-+]?\d+)?")
_QUOTED = re.compile(r'"[^"]*"')


def pick(rng: Rng, options: Any) -> Any:
    """Return one of a sequence."""
    return options[int(rng.integers(len(options)))]


def spoil_text(rng: Rng, text: str) -> bytes:
    """Return a text with one to three things wrong, as bytes of some encoding; mostly one that can still be parsed."""
    if rng.random() < PARSED:
        for _ in range(int(rng.integers(1, 4))):
            text = pick(rng, _VALUE_EDITS)(rng, text)
        return text.encode(errors="replace")
    for _ in range(int(rng.integers(1, 4))):
        text = pick(rng, _TEXT_EDITS)(rng, text)
    encoding = pick(rng, ["utf-8"] * 12 + ["utf-16", "latin-1", "utf-32", "utf-8-sig"])
    data = text.encode(encoding, errors="replace")
    return spoil_bytes(rng, data) if rng.random() < 0.1 else data


def spoil_bytes(rng: Rng, data: bytes) -> bytes:
    """Return bytes with a few flipped, lost, repeated or put in."""
    changed = bytearray(data)
    for _ in range(int(rng.integers(1, 5))):
        if not changed:
            break
        at = int(rng.integers(len(changed)))
        kind = int(rng.integers(6))
        if kind == 0:
            changed[at] ^= 1 << int(rng.integers(8))
        elif kind == 1:
            del changed[at : at + int(rng.integers(1, 40))]
        elif kind == 2:
            changed[at:at] = changed[at : at + int(rng.integers(1, 40))]
        elif kind == 3:
            changed[at:at] = rng.bytes(int(rng.integers(1, 9)))
        elif kind == 4:
            del changed[at:]
        else:
            changed[at : at + 4] = pick(rng, [b"\xff\xff\xff\xff", b"\0\0\0\0", b"\0\0\xc0\x7f", b"\0\0\x80\x7f"])
    return bytes(changed)


def spoil_tree(rng: Rng, value: Any) -> Any:
    """Return a copy of plain values in which one place, somewhere inside, is something else."""
    value = json.loads(json.dumps(value))
    holder, key = _place(rng, value)
    if holder is None:
        return pick(rng, VALUES)
    kind = int(rng.integers(8))
    if kind < 5:
        holder[key] = pick(rng, VALUES)
    elif kind == 5:
        del holder[key]
    elif kind == 6 and isinstance(holder, dict):
        holder[str(pick(rng, TEXTS))] = holder.pop(key)
    else:
        for _ in range(int(pick(rng, [1, 3, 50, 200]))):
            holder[key] = [holder[key]] if rng.random() < 0.5 else {"a": holder[key]}
    return value


def to_json(value: Any) -> str:
    """Return JSON text, of values nested however deep."""
    before, after = "", ""
    while isinstance(value, dict) and list(value) == ["a"]:
        value, before, after = value["a"], before + '{"a": ', after + "}"
    if before:
        return before + to_json(value) + after
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(k)}: {to_json(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        depth = 0
        while isinstance(value, list) and len(value) == 1:
            value, depth = value[0], depth + 1
        inner = "[" + ", ".join(map(to_json, value)) + "]" if isinstance(value, list) else to_json(value)
        return "[" * depth + inner + "]" * depth
    return json.dumps(value)


def _place(rng: Rng, value: Any) -> tuple[Any, Any]:
    """Return a random holder inside plain values and a key of it; None where there is none."""
    places = []

    def walk(part: Any) -> None:
        for key in list(part) if isinstance(part, dict) else range(len(part)):
            places.append((part, key))
            if isinstance(part[key], dict | list):
                walk(part[key])

    if isinstance(value, dict | list):
        walk(value)
    return pick(rng, places) if places else (None, None)


def _other_number(rng: Rng, text: str) -> str:
    return _replaced(rng, text, _NUMBER, pick(rng, NUMBERS))


def _other_quoted(rng: Rng, text: str) -> str:
    new = str(pick(rng, [*TEXTS, *NUMBERS]))
    return _replaced(rng, text, _QUOTED, '"' + new.translate({ord(c): None for c in '"<&\0'}) + '"')


def _swapped_quoted(rng: Rng, text: str) -> str:
    found = _QUOTED.findall(text)
    return _replaced(rng, text, _QUOTED, pick(rng, found)) if found else text


def _replaced(rng: Rng, text: str, pattern: re.Pattern[str], new: str) -> str:
    found = list(pattern.finditer(text))
    if not found:
        return text
    place = pick(rng, found)
    return text[: place.start()] + new + text[place.end() :]


def _line_lost(rng: Rng, text: str) -> str:
    lines = text.split("\n")
    del lines[int(rng.integers(len(lines)))]
    return "\n".join(lines)


def _line_repeated(rng: Rng, text: str) -> str:
    lines = text.split("\n")
    at = int(rng.integers(len(lines)))
    return "\n".join([*lines[: at + 1], *lines[at : int(rng.integers(at, len(lines))) + 1], *lines[at + 1 :]])


def _span_lost(rng: Rng, text: str) -> str:
    at = int(rng.integers(len(text) + 1))
    return text[:at] + text[at + int(rng.integers(1, 30)) :]


def _put_in(rng: Rng, text: str) -> str:
    at = int(rng.integers(len(text) + 1))
    return text[:at] + str(pick(rng, [*TEXTS, *NUMBERS, *_SIGNS])) + text[at:]


def _cut(rng: Rng, text: str) -> str:
    return text[: int(rng.integers(len(text) + 1))]


_VALUE_EDITS = (*(_other_number,) * 6, _other_quoted, *(_swapped_quoted,) * 2)
_TEXT_EDITS = (
    *_VALUE_EDITS,
    *(_line_lost, _line_repeated, _span_lost, _put_in) * 2,
    _cut,
)
