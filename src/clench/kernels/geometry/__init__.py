"""Geometry: trees of boxes, distances, depths, and where links are."""
