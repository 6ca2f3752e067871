"""Numbers in, numbers out: compiled functions of the method, without names or objects."""
