"""Mechanics: bounds of what grasps resist, and the approach of an open hand."""
