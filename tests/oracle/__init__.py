"""A second, slow, readable answer to the planar problem: it shares nothing with the solver but its definition."""
