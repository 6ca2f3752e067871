"""Vectors of three numbers, as tuples."""

from __future__ import annotations

from clench.kernels.runtime.compiling import kernel

Vector = tuple[float, float, float]


@kernel
def plus(u: Vector, v: Vector) -> Vector:
    """Return the sum of two vectors."""
    return u[0] + v[0], u[1] + v[1], u[2] + v[2]


@kernel
def scaled(u: Vector, factor: float) -> Vector:
    """Return a multiple of a vector."""
    return factor * u[0], factor * u[1], factor * u[2]


@kernel
def dot(u: Vector, v: Vector) -> float:
    """Return the scalar product of two vectors."""
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


@kernel
def cross(u: Vector, v: Vector) -> Vector:
    """Return the vector product of two vectors."""
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
