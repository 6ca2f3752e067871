"""Entries from Python to kernels that only other kernels call."""

import numba


def entry(function):
    """Return a compiled function with an entry from Python that calls a kernel."""

    @numba.njit(error_model="numpy")
    def call(*arguments):
        return function(*arguments)

    return call
