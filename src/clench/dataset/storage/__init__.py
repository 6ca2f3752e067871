"""What is written: columns, rows, parts, folder, merged file, card."""
