"""Runtime: how kernels are compiled, kept on disk, and called."""
