"""Define the content of a dataset: hands, objects, scales, the number of grasps, and the options of the planner."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import msgspec

from clench import __version__
from clench.core.caching.fingerprint import fingerprint
from clench.core.defaults import MASS
from clench.core.exceptions import ClenchError, CommandError, FileError, UnknownNameError
from clench.core.files.file_bytes import expanded
from clench.core.files.json_files import read_json
from clench.core.files.toml_files import read_toml
from clench.models.objects.object_loading import BUILTIN
from clench.models.objects.shape_text import is_shape_text, parse_shape
from clench.planner.options import APART, EFFORT, PlanOptions

from .units import Unit

SCHEMA: Final = "clench.dataset_job/1"
#: Default largest number of grasps per unit: a minute of work.
UNIT: Final = 50
#: The largest unit: its rows stay in memory.
LARGEST_UNIT: Final = 1000
#: Units of a job at most.
MOST_UNITS: Final = 1_000_000

Numbers = float | tuple[float, float]
#: Keys that are passed on to the planner as they are.
_PLANNED: Final = (
    *("friction", "mass", "gravity", "task_wrenches", "kinds", "fingers", "min_fingers", "approach"),
    *("approach_angle", "pose_sigma", "apart", "effort", "most", "path"),
)


class DatasetJob(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The content of a dataset; a file of these keys is a job file (docs/dataset.md).

    Args:
        hands, objects: models as `Hand.load` and `GraspObject.load` take them. scales: of the objects [-].
        count: grasps per hand, object and scale. seed: the same seed gives the same grasps.
        unit: number of grasps that are planned together at most; work is shared out, written and resumed in units.
        hold: test every grasp in simulation; the planner then works on the convex pieces that the simulation collides.
        friction, mass and the others: see `clench.plan_grasps`.

    Raises:
        CommandError: nothing to do, a model that is named twice, an option out of range.
    """

    hands: tuple[str, ...] = ()
    objects: tuple[str, ...] = ()
    scales: tuple[float, ...] = (1.0,)
    count: int = 100
    seed: int = 0
    unit: int = UNIT
    hold: bool = False
    friction: Numbers | None = None
    mass: Numbers = MASS
    gravity: tuple[float, float, float] | None = None
    task_wrenches: tuple[tuple[float, ...], ...] | None = None
    kinds: tuple[str, ...] | None = None
    fingers: tuple[str, ...] | None = None
    min_fingers: int = 2
    approach: tuple[float, float, float] | None = None
    approach_angle: float = math.radians(45.0)
    pose_sigma: Numbers | None = None
    apart: float = APART
    effort: int = EFFORT
    most: int | None = None
    path: bool = True

    def __post_init__(self) -> None:
        """Refuse jobs that cannot be generated."""
        for key, what in (("hands", "hand"), ("objects", "object"), ("scales", "scale")):
            values = getattr(self, key)
            kinds = (int, float) if key == "scales" else str
            if isinstance(values, str) or not isinstance(values, Sequence):
                raise CommandError(f"{key}: expected a list, got {values!r}.")
            if not all(isinstance(value, kinds) and not isinstance(value, bool) for value in values):
                raise CommandError(
                    f"{key}: expected a list of {'numbers' if key == 'scales' else 'text'}, got {values!r}."
                )
            if not values:
                raise CommandError(f"{key}: expected at least one {what}, got none.")
            twice = next((value for value in values if values.count(value) > 1), None)
            if twice is not None:
                raise CommandError(f"{key}: '{twice}' is named twice.")
        if not all(math.isfinite(scale) and scale > 0.0 for scale in self.scales):
            raise CommandError(f"scales: expected finite numbers above 0, got {list(self.scales)}.")
        whole = isinstance(self.unit, int) and isinstance(self.count, int)
        if not whole or not 1 <= self.unit <= LARGEST_UNIT:
            raise CommandError(f"unit: expected a whole number from 1 to {LARGEST_UNIT}, got {self.unit}.")
        self.options(self.count, self.seed)
        pairs = len(self.hands) * len(self.objects) * len(self.scales)
        if pairs * -(-self.count // self.unit) > MOST_UNITS:
            raise CommandError(f"unit: the job has more than {MOST_UNITS} units; give larger ones.")

    def options(self, count: int, seed: int) -> PlanOptions:
        """Return the planner's options for so many grasps, on one thread.

        Raises:
            CommandError: an option of a wrong type or out of range.
        """
        planned: dict[str, Any] = {key: getattr(self, key) for key in _PLANNED}
        return PlanOptions(count=count, seed=seed, threads=1, **planned)

    def units(self) -> Iterator[Unit]:
        """Yield the units, in the order of the rows of the dataset."""
        for hand in self.hands:
            for obj in self.objects:
                for scale in map(float, self.scales):
                    for part in range(-(-self.count // self.unit)):
                        count = min(self.unit, self.count - part * self.unit)
                        yield Unit(self.seed, hand, obj, scale, part, count)

    def document(self) -> dict[str, Any]:
        """Return the keys and values in plain form; a job file may have the same."""
        # Through the types, so that 1 and 1.0 are the same.
        same = msgspec.convert(msgspec.to_builtins(self), DatasetJob)
        values: dict[str, Any] = msgspec.to_builtins(same)
        return values

    @property
    def hash(self) -> str:
        """SHA-256 of everything that the rows depend on, besides the models' files, hexadecimal."""
        return fingerprint(SCHEMA, __version__, self.document())


def job_from(values: Mapping[str, Any], source: str) -> DatasetJob:
    """Return the job that some keys and values describe.

    Args:
        values: by key; missing keys have their defaults. source: names them in messages.

    Raises:
        UnknownNameError: no such key. CommandError: a value of a wrong type or out of range.
    """
    keys = DatasetJob.__struct_fields__
    for key in values:
        if key not in keys:
            raise UnknownNameError("key", key, source, keys)
    try:
        return msgspec.convert(dict(values), DatasetJob)
    except msgspec.ValidationError as error:
        raise CommandError(f"{source}: {_sentence(error)}") from error
    except ClenchError as error:
        raise CommandError(f"{source}: {error}") from error


def read_job(path: str | Path) -> dict[str, Any]:
    """Return the keys and values of a job file: TOML, or JSON where its name ends in .json.

    Raises:
        FileError: missing, unreadable, or no table of keys.
    """
    document = read_json(path) if Path(path).suffix.lower() == ".json" else read_toml(path)
    if not isinstance(document, dict):
        raise FileError(path, "expected keys and values, as docs/dataset.md lists them.")
    return document


def check_objects(job: DatasetJob) -> None:
    """Refuse objects that are not there, before any work is done; the files themselves are read by the units.

    Raises:
        UnknownNameError, FileError, ObjectError: no such name or file, or a shape that is none.
    """
    for model in job.objects:
        if os.path.isfile(expanded(model)) or model in BUILTIN:
            continue
        if is_shape_text(model):
            parse_shape(model)
            continue
        if not Path(model).suffix and len(Path(model).parts) <= 1:
            raise UnknownNameError("object", model, "the built-in objects, and there is no such file", BUILTIN)
        raise FileError(model, "no such file.")


def _sentence(error: msgspec.ValidationError) -> str:
    """Return a sentence about a wrong value that begins with its key."""
    if isinstance(error.__cause__, ClenchError):
        return str(error.__cause__)
    text, _, place = str(error).partition(" - at `$.")
    return f"{place.rstrip('`')}: {text[:1].lower()}{text[1:]}." if place else f"{text}."
