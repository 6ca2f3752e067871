"""Understanding: what the fingers, the palm, the roles and the couplings of a hand are."""
