"""The command line: `clench demo | solve | hand | execute | record | bench`."""
