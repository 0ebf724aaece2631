"""Command lines identify and curves, with the tables, files and pictures that they produce."""
