"""Whether the tests of the sweep kernels notice mistakes that are put into them."""
