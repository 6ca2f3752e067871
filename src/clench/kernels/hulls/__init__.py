"""Convex hulls of a body's parts: what planes keep off them while they move, and what they come near to."""
