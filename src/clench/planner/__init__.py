"""Where to put the hand: propose many wrist poses, close the hand at all, keep the best (docs/method.md section 9)."""
