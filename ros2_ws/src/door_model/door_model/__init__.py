"""Model of a swing door with a closer: linkage, motion, recordings, and identification."""
