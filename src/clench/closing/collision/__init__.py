"""Collision: where a posed hand overlaps an object, how far it is from it, and which paths are free."""
