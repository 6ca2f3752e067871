"""Time of impact: when moving bodies first touch, bounds on it, and paths that are free."""
