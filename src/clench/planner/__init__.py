"""Plan where to put the hand: propose wrist poses, close the hand at all, keep the best (docs/method.md section 9)."""
