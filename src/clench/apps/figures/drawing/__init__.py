"""What every picture needs: camera, stage, style, marks."""
