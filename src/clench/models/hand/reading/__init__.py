"""Reading: from the files of a hand to links, joints and shapes."""
