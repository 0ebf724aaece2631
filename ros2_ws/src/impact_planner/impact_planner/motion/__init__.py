"""Motions before and after the hit, checked against every limit; Fig. 6 is in `cam_curve`."""
