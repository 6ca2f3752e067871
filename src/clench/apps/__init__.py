"""What people touch: command line, figures, benchmarks. Nothing imports these."""
