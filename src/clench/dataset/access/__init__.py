"""Read a dataset, as rows, arrays or files of other formats."""
