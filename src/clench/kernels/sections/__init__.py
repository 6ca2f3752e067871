"""Sections: curl planes, their curves and outlines, and first touches in closed form."""
