"""Objects, read from meshes or made from shapes, and checked."""
