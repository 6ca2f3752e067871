"""Closing: from a command and a hand to a plan, to packed arrays, to the candidates that the kernels closed."""
