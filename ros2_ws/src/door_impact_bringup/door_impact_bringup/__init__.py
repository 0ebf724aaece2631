"""Launch files, parameters, the door for viewers and the recorder of hrp2_door_impact."""
