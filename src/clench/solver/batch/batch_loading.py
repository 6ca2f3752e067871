"""Read the columns of a batch from a file, and check that they fit each other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from clench.core.exceptions import FileError
from clench.core.files.array_files import read_arrays
from clench.core.pose import FloatArray
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject

from .grasp_batch import FINGER_STATUSES, PER_POSE, STATUSES, BatchContacts, GraspBatch, Question
from .saved_question import SavedBatch, geometry_hash

OF_CONTACTS: Final = tuple(f"contact_{f.name}" for f in fields(BatchContacts))
#: The arrays of a file that a batch is made of.
COLUMNS: Final = (*PER_POSE, *OF_CONTACTS)
_NAMES: Final = ("joint_names", "finger_names", "link_names", "body_names")


def load_batch(path: str | Path, hand: Hand | None, obj: GraspObject | None) -> GraspBatch:
    """Read a file of a batch; see `GraspBatch.load`."""
    saved = SavedBatch(path)
    hand = Hand.load(saved.hand_model) if hand is None else hand
    if obj is None:
        obj = GraspObject.load(
            saved.object_model, scale=saved.object_scale, collision_source=saved.object_collision_source
        )
    found = read_arrays(path, (*COLUMNS, *_NAMES, "preshape"))
    text = {name: tuple(found.pop(name, np.empty(0)).tolist()) for name in (*_NAMES, "preshape")}
    chosen = text.pop("preshape")
    _check_models(saved, hand, obj, text["body_names"])
    question = _question(saved, hand, obj, any(chosen))
    names = {**text, "question": question}
    if not is_whole(found, names, found.get("hand_poses", np.empty(0))):
        raise FileError(path, "its arrays do not fit each other, or some are missing.")
    batch = batch_of(found, names)
    if tuple(batch.preshape.tolist()) != chosen:
        raise FileError(path, f"has other preshapes than hand '{hand.name}'; solve the batch again.")
    return batch


def batch_of(found: Mapping[str, NDArray[Any]], names: Mapping[str, Any]) -> GraspBatch:
    """Return the batch of arrays that `is_whole` has checked."""
    contacts = BatchContacts(**{f.name: found[f"contact_{f.name}"] for f in fields(BatchContacts)})
    columns: dict[str, Any] = {name: found[name] for name in PER_POSE}
    return GraspBatch(**names, **columns, contacts=contacts)


def _question(saved: SavedBatch, hand: Hand, obj: GraspObject, chooses: bool) -> Question:
    """Return the request: with the preshapes that were compared, or with those that were given."""
    from clench.solver.preshapes.postures import posture_options

    command = saved.command
    options = posture_options(hand, command) if chooses else ()
    return Question(hand, obj, command, {} if chooses else saved.preshapes, options)


def _check_models(saved: SavedBatch, hand: Hand, obj: GraspObject, bodies: tuple[str, ...]) -> None:
    """Check that the models have the geometry that was solved.

    Raises:
        FileError: they do not.
    """
    for_hand, _, for_object = saved.geometry_hash.partition("+")
    own_hand, _, own_object = geometry_hash(hand, obj, saved.command).partition("+")
    if for_hand != own_hand:
        problem = f"was solved for another geometry of hand '{hand.name}': give hand=, loaded as it was."
        raise FileError(saved.path, problem)
    if for_object != own_object:
        missing = [name for name in bodies if name not in [body.name for body in obj.bodies]]
        named = f" with {', '.join(map(repr, missing))}" if missing else ""
        problem = f"was solved for another geometry of object '{obj.name}': give obj=, the object{named} as it was."
        raise FileError(saved.path, problem)


def is_whole(found: Mapping[str, NDArray[Any]], names: Mapping[str, Any], rows: FloatArray) -> bool:
    """Return whether arrays are a complete part: all names, the right poses, and meaningful numbers."""
    if found.keys() != set(COLUMNS) or not np.array_equal(found["hand_poses"], rows):
        return False
    poses, joints, fingers = len(rows), len(names["joint_names"]), len(names["finger_names"])
    contacts = found["contact_finger"].size
    shapes = {
        **dict.fromkeys(OF_CONTACTS, (contacts,)),
        **dict.fromkeys(PER_POSE, (poses,)),
        "contact_first": (poses + 1,),
        "contact_position": (contacts, 3),
        "contact_normal": (contacts, 3),
        "hand_poses": (poses, 7),
        "object_poses": (poses, 7),
        "joint_angles": (poses, joints),
        "finger_codes": (poses, fingers),
        "planes": (poses, fingers),
    }
    if any(found[key].shape != shape or found[key].dtype.kind == "U" for key, shape in shapes.items()):
        return False
    counts = {
        "status_codes": len(STATUSES),
        "finger_codes": len(FINGER_STATUSES),
        "preshape_codes": max(len(names["question"].options), 1),
        "contact_finger": fingers,
        "contact_link": len(names["link_names"]),
        "contact_joint": joints,
        "contact_body": len(names["body_names"]),
    }
    first = found["contact_first"]
    return (
        all(0 <= found[key].min(initial=0) <= found[key].max(initial=0) < count for key, count in counts.items())
        and (first[0], first[-1]) == (0, contacts)
        and bool((np.diff(first) >= 0).all())
    )
