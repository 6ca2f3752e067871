"""Pictures of curl planes."""
