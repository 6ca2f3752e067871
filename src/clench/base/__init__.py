"""Errors, poses, tolerances and array types: what every layer may use."""
