"""The files of a dataset: columns, rows, parts, folder, merged file, card."""
