"""The work of a dataset: the job, its units, shards of units, hands and objects."""
