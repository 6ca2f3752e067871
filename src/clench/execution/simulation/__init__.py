"""Simulation: the hand in MuJoCo, the hold test, films."""
