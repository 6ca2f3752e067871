"""Meetings: where fingers that move at once first touch each other, and how they hold each other from there on."""
