"""The tolerances of the method, with units and the section of docs/method.md that gives each."""

from __future__ import annotations

from typing import Final

#: Feature pairs with |gap| below this fraction of the finger's length touch [-] (section 3).
TOUCH_FRACTION: Final = 1e-9
#: The full-width sweep stops a link at a positive gap of at most this fraction of the finger's length [-] (section 5).
SWEEP_FRACTION: Final = 1e-10
#: Foot points count as inside up to this fraction of the feature's length [-] (section 3).
FOOT_FRACTION: Final = 1e-12
#: Axes closer than this are of one axis group [rad] (section 1). With 1e-6, a finger of 0.1 m would be off by
#: 1e-7 m: a hundred times the gap tolerance of a contact.
PARALLEL_ANGLE: Final = 1e-9
#: Joints within this of the most distal joint's axis close the finger [rad] (section 1).
CLOSING_ANGLE: Final = 0.08726646259971647  # 5 degrees
#: A contact that a later motion opened by more than this is `passed` [m] (section 4).
PASSED_GAP: Final = 1e-6
#: A contact overlaps by less than this, which is rounding [m] (section 4).
CONTACT_OVERLAP: Final = 1e-9
#: A set is feasible up to this penetration, besides the pads' allowance [m] (section 5).
ALLOWED_PENETRATION: Final = 1e-6
#: Edge planes lie inside the finger by this fraction of its width [-] (section 1).
EDGE_INSET: Final = 1e-4
#: Round shapes cut obliquely become outlines that deviate by at most this [m] (section 2).
OUTLINE_DEVIATION: Final = 1e-6
#: Range of lengths and coordinates that hands, objects and places can have [m].
SMALLEST_LENGTH: Final = 1e-13
LARGEST_LENGTH: Final = 1e9
#: Quaternions whose norm is off by more than this are refused [-].
QUATERNION_NORM: Final = 1e-3
