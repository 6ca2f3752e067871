"""Motions to play."""
