"""Draw without a screen, through MuJoCo and OpenGL."""
