"""Pictures of grasps and preshapes."""
