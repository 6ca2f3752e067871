"""Trees of boxes around the elements of meshes: growing them, the boxes, and what is connected."""
