"""Scoring: criteria, their calibration, and the choice among candidates."""
