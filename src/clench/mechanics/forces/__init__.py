"""Contact forces and joint torques that hold a load."""
