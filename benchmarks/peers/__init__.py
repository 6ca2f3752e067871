"""Other ways to close a hand, on the same shapes and poses: steppers like those of other programs, and MuJoCo."""
