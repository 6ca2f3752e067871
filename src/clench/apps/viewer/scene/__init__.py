"""What the page draws in three dimensions."""
