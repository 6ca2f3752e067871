"""Sending a solution to a hand: trajectories, and a simulated hand."""
