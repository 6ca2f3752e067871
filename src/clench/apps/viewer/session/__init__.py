"""The state of the page, and its answers."""
