"""Preshapes: the postures of a hand from which clench chooses."""
