"""The wrenches that a grasp resists, and bounds of them."""
