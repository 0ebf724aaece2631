"""What every package needs: errors, constants, files, and the parameters and start of a node."""
