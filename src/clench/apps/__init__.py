"""User interfaces: command line and figures. Nothing imports these."""
