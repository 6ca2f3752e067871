"""Files: read whole and within limits, written complete or not at all."""
