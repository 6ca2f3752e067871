"""Benchmarks of clench, `clench bench NAME`: they check their own answers first, and print flat `key value` lines.

They are part of a checkout, not of the package. `speed` measures solves and choices, `peers` compares with other ways
of closing, `holding` tries grasps in simulation.
"""
