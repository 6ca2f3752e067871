"""Rate all grasps of a batch at once: the bound of epsilon of every answer (docs/method.md section 6)."""

from __future__ import annotations

from numpy.typing import ArrayLike

from clench.core.argument_types import check_type
from clench.core.exceptions import CommandError, UnknownNameError
from clench.core.numbers import is_finite_number
from clench.core.pose import FloatArray, checked_vector
from clench.mechanics.grasp.contacts import DEFAULT_TORSION, ContactModel, friction_range
from clench.solver.batch.batch_epsilon import BatchEpsilon
from clench.solver.batch.grasp_batch import GraspBatch


def batch_epsilon(
    batch: GraspBatch,
    *,
    contact_model: ContactModel | str = ContactModel.POINT,
    friction: float | tuple[float, float] | None = None,
    torsion: float = DEFAULT_TORSION,
    center_of_mass: ArrayLike | None = None,
) -> FloatArray:
    """Return a lower bound of the epsilon quality of every pose, shape (N,) [N per N of normal force].

    An answer whose bound is above 0 has force closure. The bound is that of the L1 norm. It takes a small part of the
    time of `grasp_quality(...).epsilon`. A bound of 0 means that the search found no force closure, although it may
    exist, or that the answer is neither a grasp nor partial.

    Args:
        batch: the answers. contact_model, friction, torsion, center_of_mass: see `grasp_quality`.

    Raises:
        CommandError: a value out of range. UnknownNameError: no such contact model.
    """
    check_type(batch, GraspBatch, "batch")
    if contact_model not in list(ContactModel):
        raise UnknownNameError("contact model", str(contact_model), "clench", list(ContactModel))
    if not (is_finite_number(torsion) and torsion > 0.0):
        raise CommandError(f"torsion: expected a number above 0 [m], got {torsion!r}.")
    soft = ContactModel(contact_model) is ContactModel.SOFT
    lowest = None if friction is None else friction_range(friction)[0]
    center = None
    if center_of_mass is not None:
        center = checked_vector(center_of_mass, 3, "center_of_mass", "[x, y, z] in metres")
    asked = batch.question
    return BatchEpsilon(asked.hand, asked.obj, lowest, torsion if soft else None, center).bounds(batch)
