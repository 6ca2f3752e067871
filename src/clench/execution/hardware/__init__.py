"""Hardware: real hands, driven through a controller, checked and supervised."""
