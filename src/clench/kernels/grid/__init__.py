"""Capsules and spheres that move towards an object: a grid of distances far away, planes near by."""
