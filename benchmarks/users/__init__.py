"""Benchmarks of what users wait for: makers' hands, whole commands, planning; beside another version of the project."""
