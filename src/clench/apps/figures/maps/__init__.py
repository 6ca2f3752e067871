"""Maps of a hand and of an object."""
