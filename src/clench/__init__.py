"""Close a robot hand around a known object, in closed form, and carry it out."""
