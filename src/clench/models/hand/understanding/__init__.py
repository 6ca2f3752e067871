"""Understand a hand: its fingers, palm, roles and couplings."""
