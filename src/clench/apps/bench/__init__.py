"""Benchmarks: they check their own answers first, and print flat `key value` lines."""
