"""What people touch: command line and figures. Nothing imports these."""
