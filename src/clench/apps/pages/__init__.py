"""Pages that show grasps in a browser: one file each, with everything in it."""
