"""Name preshapes by their kind and by the distance of the pads where they oppose best."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import count
from string import ascii_lowercase
from typing import Final

from clench.core.pose import FloatArray

#: The name of the preshape that sets nothing.
OPEN: Final = "open"
#: Pads that are nearer than the first distance pinch, and wider than the second are wide [m].
_PINCH: Final = 0.04
_WIDE: Final = 0.08


def name_preshapes(shapes: Sequence[tuple[FloatArray, FloatArray, bool]]) -> list[str]:
    """Return a name of every preshape of a hand; the first is the open hand.

    A name gives the kind and the distance of the pads in millimetres where they oppose best: "pinch-20mm" below 40 mm,
    "grip-60mm", "wide-90mm" from 80 mm on. In "curled-60mm" the fingers are bent before they close. Preshapes with the
    same name get a letter: "wide-90mm-b".

    Args:
        shapes: apertures [m] and qualities [-] of its zones, shape (Z,) each, and whether fingers are bent.
    """
    if not shapes:
        return []
    taken: set[str] = {OPEN}
    names = [OPEN]
    for aperture, quality, bent in shapes[1:]:
        base = _base(aperture, quality, bent)
        names.append(next(name for name in _variants(base) if name not in taken))
        taken.add(names[-1])
    return names


def _base(aperture: FloatArray, quality: FloatArray, bent: bool) -> str:
    if not len(aperture):
        return "fist"
    width = float(aperture[int(quality.argmax())])
    kind = "curled" if bent else "pinch" if width < _PINCH else "wide" if width >= _WIDE else "grip"
    return f"{kind}-{width * 1e3:.0f}mm"


def _variants(base: str) -> Iterator[str]:
    yield base
    yield from (f"{base}-{letter}" for letter in ascii_lowercase[1:])
    yield from (f"{base}-{number}" for number in count(27))
