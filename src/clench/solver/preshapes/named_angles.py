"""Named angles as a posture of a hand."""

from __future__ import annotations

from typing import Any

import numpy as np

from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray
from clench.models.hand.hand import Hand


def posture(angles: Any, hand: Hand, key: str) -> FloatArray:
    """Return named angles in model order, shape (J,) [rad].

    Raises:
        CommandError: a joint of the hand is missing, or a name is not one of its joints.
    """
    missing = [name for name in hand.joint_names if name not in angles]
    extra = sorted(set(angles) - set(hand.joint_names))
    if missing or extra:
        problem = f"joint '{missing[0]}' is missing" if missing else f"'{extra[0]}' is no joint of it"
        raise CommandError(f"{key}: the solution does not fit hand '{hand.name}': {problem}.")
    return np.array([angles[name] for name in hand.joint_names], dtype=np.float64)
