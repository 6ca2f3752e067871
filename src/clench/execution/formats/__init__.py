"""Grasps in other programs' files, out and in."""
