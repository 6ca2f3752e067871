"""How long solves, batches, choices and grasp qualities take, and how this grows with the problem."""
