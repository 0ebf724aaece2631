"""What every package needs: errors, constants, files, and the start and end of a node."""
