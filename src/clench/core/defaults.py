"""The values that are used for mass, friction and reserve where the caller gives none: one set for everything."""

from __future__ import annotations

from typing import Final

#: Mass of the object [kg]: that of DexGraspBench's hold test.
MASS: Final = 0.1
#: Sliding friction of links on the object where neither is known [-]: that of the same test.
FRICTION: Final = 0.6
#: A squeeze counts on this part of the lowest friction [-].
FRICTION_RESERVE: Final = 0.8
#: A squeeze resists disturbances up to this multiple [-].
LOAD_RESERVE: Final = 2.0
#: Torques of a squeeze are at least this multiple of the friction in the joints, weighted by the torques [-].
LOSS_RESERVE: Final = 10.0
#: Normal forces of a squeeze sum to at most this multiple of the heaviest object's weight [-],
MOST_FORCE_PER_WEIGHT: Final = 40.0
#: or to this much where the object weighs next to nothing [N].
MOST_FORCE_OF_LIGHT: Final = 10.0
