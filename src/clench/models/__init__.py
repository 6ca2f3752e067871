"""The three inputs: hand, object and command."""
