"""A grasp as mechanics sees it: contacts, loads, grasp map, Jacobian, limits."""
