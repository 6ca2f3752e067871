"""Malformed and extreme inputs: every one gives a finite answer, or one clear sentence (`python -m fuzz.run`)."""
