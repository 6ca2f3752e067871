"""Mechanics: bounds of the wrenches that grasps resist, and the approach of an open hand."""
