"""Closing: one finger, all fingers, and the one entry of every solve."""
