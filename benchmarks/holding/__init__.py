"""Which share of planned grasps holds the object in simulation."""
