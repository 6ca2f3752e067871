"""Many poses: batches, streams and the tracker."""
