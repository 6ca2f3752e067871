"""Contact mechanics: contacts and forces, what a grasp resists, and what it costs to hold (METHOD.md section 6)."""
