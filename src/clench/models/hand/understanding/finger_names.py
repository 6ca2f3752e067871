"""Give fingers short names, from the names of their joints and links or from their place."""

from __future__ import annotations

import re
from collections import Counter

_THUMB = ("thumb", "th", "thmb", "pouce", "daumen")
_KNOWN = (*_THUMB, "index", "ff", "forefinger", "middle", "mf", "ring", "rf", "little", "lf", "pinky", "pinkie")
_BY_PLACE = ("index", "middle", "ring", "little")


def names_thumb(name: str) -> bool:
    """Return whether a finger's name says that it is a thumb."""
    return name.lower() in _THUMB


def short_names(joint_names: list[list[str]], link_names: list[list[str]]) -> list[str]:
    """Return a short name for every finger, empty where its joints and links tell nothing.

    Args:
        joint_names: own joints of every finger, palm side first. link_names: its links.

    A finger is named by a word that is in all its joint names and in no other finger's. Without such a word, the rest
    of their common beginning names it, or else a known word that most of its links share.
    """
    beginnings = _beginnings(joint_names)
    common = [_common_words(names) for names in joint_names]
    found: list[str] = []
    for i, names in enumerate(joint_names):
        others = set().union(*(c for k, c in enumerate(common) if k != i)) if len(common) > 1 else set()
        unique = [w for w in _words(names[0]) if w in common[i] and w not in others]
        known = [w for w in unique if w in _KNOWN]
        named = [w for w in unique if re.search("[a-z]", w)]
        found.append(next(iter(known or _sound(beginnings[i]) or named or _link_word(i, link_names)), ""))
    counts = Counter(found)
    return [name if counts[name] == 1 else "" for name in found]


def place_names(places: list[float], thumb: int | None, taken: list[str]) -> list[str]:
    """Fill in names by place: counted from the thumb's side, or by number.

    Args:
        places: of every finger's base along the row of fingers, from the thumb's side [m]; unused without a thumb.
        thumb: index of the thumb, or None. taken: names found so far, empty where unknown.
    """
    names = list(taken)
    unknown = [i for i, name in enumerate(names) if not name]
    if thumb in unknown:
        names[thumb] = "thumb"
        unknown.remove(thumb)
    others = [i for i in range(len(names)) if i != thumb]
    if thumb is not None and unknown == others and 2 <= len(others) <= len(_BY_PLACE):
        for name, i in zip(_BY_PLACE, sorted(others, key=lambda i: places[i]), strict=False):
            names[i] = name
        return names
    for i in unknown:
        names[i] = next(n for n in (f"finger{k}" for k in range(i + 1, 99)) if n not in names)
    return names


def _words(name: str) -> list[str]:
    """Split a name at separators and where a small letter meets a capital."""
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", name)
    return [w.lower() for w in re.split(r"[^A-Za-z0-9]+", spaced) if w]


def _common_words(names: list[str]) -> set[str]:
    return set.intersection(*(set(_words(n)) for n in names))


def _beginnings(joint_names: list[list[str]]) -> list[str]:
    """Return the common beginning of every finger's joints, without the part that other fingers share."""
    own = [_shared_beginning(names) for names in joint_names]
    result: list[str] = []
    for i, mine in enumerate(own):
        shared = max((len(_common_prefix([mine, other])) for k, other in enumerate(own) if k != i), default=0)
        cut = _word_start(mine, shared)
        if not re.search("[A-Za-z]", mine[cut:]) and cut > 0:
            cut = _word_start(mine, cut - 1)
        result.append(mine[cut:])
    return result


def _shared_beginning(names: list[str]) -> str:
    """Return the common beginning of all names, never half of a number; nothing for a single name."""
    prefix = _common_prefix(names) if len(names) > 1 else ""
    if any(name[len(prefix) :][:1].isdigit() for name in names):
        prefix = prefix.rstrip("0123456789")
    return prefix


def _word_start(name: str, place: int) -> int:
    """Return where the word at a place of a name starts."""
    return max(name.rfind(separator, 0, place) for separator in "_/-.: ") + 1


def _sound(beginning: str) -> list[str]:
    """Return a common beginning as a name, when it is one: separators, a trailing J and digits taken off."""
    name = beginning.strip("_/-.: ")
    name = re.sub(r"_?(j|joint)_?$", "", name, flags=re.IGNORECASE).strip("_/-.: ").lower()
    return [name] if re.search("[a-z]", name) and len(name) <= 12 else []


def _link_word(finger: int, link_names: list[list[str]]) -> list[str]:
    """Return the known word that most of a finger's links have and no other finger's."""
    others = {w for k, names in enumerate(link_names) if k != finger for n in names for w in _words(n)}
    counts = Counter(w for n in link_names[finger] for w in set(_words(n)) if w in _KNOWN and w not in others)
    return [w for w, _ in counts.most_common(1)]


def _common_prefix(names: list[str]) -> str:
    first, last = min(names), max(names)
    length = next((i for i, c in enumerate(first) if i >= len(last) or c != last[i]), len(first))
    return first[:length]
