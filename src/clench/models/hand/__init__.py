"""Hands, read from URDF or MJCF and understood."""
