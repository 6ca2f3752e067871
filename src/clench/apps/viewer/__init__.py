"""A page in the browser that solves while the user drags."""
