"""What is generated: the job, its units of work, shards of them, hands and objects."""
