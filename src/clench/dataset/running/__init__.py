"""Do the units of a job on one machine."""
