"""Kernels of the steppers. Only these benchmarks call them."""
