"""Contact mechanics: contacts, forces, what a grasp resists, what it costs to hold (docs/method.md section 6)."""
