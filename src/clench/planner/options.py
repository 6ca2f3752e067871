"""The options of the planner, checked once."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from numbers import Integral, Real
from typing import Any, Final, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clench.core.defaults import MASS
from clench.core.exceptions import CommandError, UnknownNameError
from clench.core.pose import FloatArray, checked_vector
from clench.mechanics.grasp.contact_kinds import GraspKind
from clench.mechanics.grasp.contacts import DEFAULT_TORSION, ContactModel, friction_range
from clench.mechanics.grasp.loads import check_loads, mass_range
from clench.models.hand.hand import Hand

from .regions import Region

#: Proposals per grasp that is wanted: the best one of so many is returned.
EFFORT: Final = 40
#: Two grasps are alike when their links are nearer than this, as a root mean square over all links [m].
APART: Final = 0.02
#: Reachability: poses of the palm in the world, (N, 4, 4), to whether each can be reached, (N,).
Reachable = Callable[[FloatArray], ArrayLike]


class PlanArguments(TypedDict, total=False):
    """Name the options besides the number of grasps; `clench.plan_grasps` explains them."""

    friction: float | tuple[float, float] | None
    mass: float | tuple[float, float]
    gravity: ArrayLike | None
    task_wrenches: ArrayLike | None
    contact_model: ContactModel | str | None
    torsion: float
    kinds: Sequence[GraspKind | str] | None
    fingers: Sequence[str] | None
    min_fingers: int
    approach: ArrayLike | None
    approach_angle: float
    touch: Region | None
    avoid: Region | None
    reachable: Reachable | None
    pose_sigma: float | tuple[float, float] | None
    apart: float
    effort: int
    most: int | None
    seconds: float | None
    seed: int
    threads: int | None
    path: bool


@dataclass(frozen=True)
class PlanOptions:
    """Say which grasps are wanted; `clench.plan_grasps` explains every field.

    Raises:
        CommandError: a value of a wrong type or out of range.
    """

    count: int = 10
    friction: float | tuple[float, float] | None = None
    mass: float | tuple[float, float] = MASS
    gravity: ArrayLike | None = None
    task_wrenches: ArrayLike | None = None
    contact_model: ContactModel | str | None = None
    torsion: float = DEFAULT_TORSION
    kinds: Sequence[GraspKind | str] | None = None
    fingers: Sequence[str] | None = None
    min_fingers: int = 2
    approach: ArrayLike | None = None
    approach_angle: float = float(np.deg2rad(45.0))
    touch: Region | None = None
    avoid: Region | None = None
    reachable: Reachable | None = None
    pose_sigma: float | tuple[float, float] | None = None
    apart: float = APART
    effort: int = EFFORT
    most: int | None = None
    seconds: float | None = None
    seed: int = 0
    threads: int | None = None
    path: bool = True

    def __post_init__(self) -> None:
        """Refuse options that the planner cannot meet."""
        for key in ("friction", "mass", "pose_sigma"):
            object.__setattr__(self, key, _range(getattr(self, key), key))
        for key in ("kinds", "fingers"):
            object.__setattr__(self, key, _names(getattr(self, key), key))
        for key, least in (("count", 1), ("min_fingers", 2), ("effort", 1), ("seed", 0)):
            _check_whole(getattr(self, key), key, least)
        for key in ("most", "threads"):
            if getattr(self, key) is not None:
                _check_whole(getattr(self, key), key, 1)
        if self.contact_model not in [None, *ContactModel]:
            raise CommandError(f"contact_model: expected one of {', '.join(ContactModel)}, got {self.contact_model!r}.")
        for key in ("torsion", "apart", "approach_angle", "seconds"):
            _check_number(getattr(self, key), key)
        if self.approach_angle > np.pi:
            raise CommandError(
                f"approach_angle: expected at most pi rad, got {self.approach_angle:g}; is it in degrees?"
            )
        if self.friction is not None:
            friction_range(self.friction)
        mass_range(self.mass)
        if self.gravity is not None:
            _direction(self.gravity, "gravity")
        if self.approach is not None:
            _direction(self.approach, "approach")
        if self.task_wrenches is not None:
            check_loads(self.task_wrenches)
        for kind in self.kinds or ():
            if kind not in list(GraspKind):
                raise CommandError(f"kinds: expected some of {', '.join(GraspKind)}, got {kind!r}.")
        if self.kinds is not None and not self.kinds:
            raise CommandError(f"kinds: expected at least one of {', '.join(GraspKind)}, got none.")
        if set(self.kinds or ()) == {GraspKind.PINCH} and self.min_fingers > 2:
            raise CommandError(f"kinds: a pinch has two fingers, but min_fingers is {self.min_fingers}.")
        if set(self.kinds or ()) and set(self.kinds or ()) <= {"pinch", "tripod"} and self.min_fingers > 3:
            raise CommandError(f"kinds: a tripod has three fingers, but min_fingers is {self.min_fingers}.")
        for key in ("touch", "avoid"):
            if not isinstance(getattr(self, key), Region | None):
                raise CommandError(f"{key}: expected a clench.Region, got {type(getattr(self, key)).__name__}.")
        if self.reachable is not None and not callable(self.reachable):
            raise CommandError(f"reachable: expected a function, got {type(self.reachable).__name__}.")
        if self.pose_sigma is not None:
            for value in np.atleast_1d(np.asarray(self.pose_sigma, dtype=object)):
                _check_number(value, "pose_sigma")

    @property
    def proposals(self) -> int:
        """The largest number of wrist poses that are proposed."""
        return self.most if self.most is not None else max(2000, 4 * self.effort * self.count)

    @property
    def lowest_friction(self) -> float | None:
        """The lowest friction that is planned for [-]; None: that of links and object."""
        return None if self.friction is None else friction_range(self.friction)[0]

    @property
    def model(self) -> ContactModel:
        """Model of the contacts: two point contacts resist no twist about their line, so pinches have soft fingers."""
        if self.contact_model is None:
            return ContactModel.SOFT if set(self.kinds or ()) == {GraspKind.PINCH} else ContactModel.POINT
        return ContactModel(self.contact_model)

    @property
    def sigma(self) -> tuple[float, float] | None:
        """Standard deviations of the object's position [m] and of its rotation [rad]; None: the pose is exact."""
        if self.pose_sigma is None:
            return None
        if isinstance(self.pose_sigma, tuple):
            return self.pose_sigma
        # 0.6 degrees for every millimetre.
        return float(self.pose_sigma), float(np.deg2rad(0.6) * self.pose_sigma * 1e3)

    def closing_fingers(self, hand: Hand) -> tuple[str, ...]:
        """Return the names of the fingers that may close.

        Raises:
            UnknownNameError: no such finger.
        """
        names = tuple(finger.name for finger in hand.fingers)
        for name in self.fingers or ():
            if name not in names:
                raise UnknownNameError("finger", name, f"hand '{hand.name}'", names)
        return names if self.fingers is None else tuple(self.fingers)

    def sets_of_fingers(self, hand: Hand) -> tuple[tuple[str, ...], ...]:
        """Return which fingers close together, set by set, as the kinds ask for.

        Raises:
            UnknownNameError: no such finger. CommandError: the hand has too few of them.
        """
        names = self.closing_fingers(hand)
        if len(names) < self.min_fingers:
            raise CommandError(
                f"fingers: expected at least {self.min_fingers} fingers that close, hand '{hand.name}' has "
                f"{', '.join(names) or 'none'}."
            )
        thumbs = {f.name for f in hand.fingers if f.is_thumb} & set(names)
        kinds = set(self.kinds or (GraspKind.POWER,))
        found = [names] if kinds & {GraspKind.POWER, GraspKind.PRECISION} else []
        for kind, size in ((GraspKind.PINCH, 2), (GraspKind.TRIPOD, 3)):
            if kind in kinds:
                sets = itertools.combinations(names, size)
                found += [some for some in sets if not thumbs or thumbs & set(some)]
        return tuple(dict.fromkeys(found))

    def depths(self) -> tuple[bool, ...]:
        """Return whether hands stay at their place, and whether they go on until the palm is at the object."""
        return (False, True) if self.kinds is None or GraspKind.POWER in self.kinds else (False,)


def is_reached(reachable: Reachable, poses: FloatArray) -> NDArray[np.bool_]:
    """Return which poses of the palm can be reached, as the caller's function says.

    Args:
        reachable: the function. poses: `T_world_palm`, shape (N, 4, 4).

    Raises:
        CommandError: the function raised, or returned anything but N truth values.
    """
    try:
        found = np.asarray(reachable(poses.copy()))
    except Exception as error:
        raise CommandError(f"reachable: the function raised {type(error).__name__}: {error}") from error
    if found.shape != (len(poses),) or found.dtype.kind not in "bi":
        raise CommandError(
            f"reachable: expected {len(poses)} truth values, one per pose, got shape {found.shape} of {found.dtype}."
        )
    return found.astype(np.bool_)


def _range(value: Any, key: str) -> Any:
    """Return a list or an array of two numbers as a pair; anything else as it is.

    Raises:
        CommandError: another number of numbers.
    """
    if not isinstance(value, list | tuple | np.ndarray):
        return value
    if len(value) != 2:
        raise CommandError(f"{key}: expected one number or two, got {len(value)}.")
    return tuple(each.item() if isinstance(each, np.generic) else each for each in value)


def _names(value: Any, key: str) -> tuple[str, ...] | None:
    """Return names as a tuple.

    Raises:
        CommandError: no names.
    """
    if value is None or (isinstance(value, Iterable) and not isinstance(value, str)):
        return None if value is None else tuple(value)
    raise CommandError(f"{key}: expected names, such as a list, got {value!r}.")


def _check_whole(value: Any, key: str, least: int) -> None:
    if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
        raise CommandError(f"{key}: expected a whole number of at least {least}, got {value!r}.")


def _check_number(value: Any, key: str) -> None:
    if value is None and key == "seconds":
        return
    if isinstance(value, bool) or not isinstance(value, Real) or not np.isfinite(float(value)) or value <= 0.0:
        raise CommandError(f"{key}: expected a finite number above 0, got {value!r}.")


def _direction(value: ArrayLike, key: str) -> FloatArray:
    """Return a unit vector.

    Raises:
        CommandError: not three finite numbers, or of no length.
    """
    vector = checked_vector(value, 3, key, "[x, y, z]")
    size = float(np.linalg.norm(vector))
    if not size > 0.0:
        raise CommandError(f"{key}: expected a direction, got a vector of no length.")
    return vector / size
