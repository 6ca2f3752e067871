"""Entries from Python to kernels that only other kernels call."""

import numba


def entry(function):
    """Return a compiled function with an entry from Python that calls a kernel; one that runs as Python as it is."""
    if not hasattr(function, "py_func"):
        return function

    @numba.njit(error_model="numpy")
    def call(*arguments):
        return function(*arguments)

    return call
