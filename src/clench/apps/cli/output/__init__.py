"""Print tables and write results."""
