"""Keep what takes long to compute: in memory, in a folder, and only when it is read."""
