"""Analysis of a solution: quality, squeeze, sensitivity, errors of the pose, records and examples."""
