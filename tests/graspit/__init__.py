"""Closing all joints at once, compared with cases that GraspIt! computed."""
