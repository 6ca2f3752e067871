"""Measure collisions: overlap of a posed hand with an object, distance from it, and free paths."""
