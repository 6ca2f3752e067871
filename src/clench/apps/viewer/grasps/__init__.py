"""Lists of grasps to look through."""
