"""The solver: three inputs in, one solution out; saved, loaded and recorded."""
