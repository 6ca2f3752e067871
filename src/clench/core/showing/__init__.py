"""Show objects as text and in notebooks."""
