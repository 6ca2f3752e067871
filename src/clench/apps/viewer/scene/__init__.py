"""The three-dimensional scene of the page: hand, object, contacts, small grasps, camera."""
