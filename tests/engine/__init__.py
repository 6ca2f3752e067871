"""An independent engine (python-fcl) judges contacts in three dimensions."""
