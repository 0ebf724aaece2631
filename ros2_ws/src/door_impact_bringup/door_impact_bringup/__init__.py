"""Launch files, parameters and the demonstration of hrp2_door_impact."""
