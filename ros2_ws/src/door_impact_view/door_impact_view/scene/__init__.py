"""What there is to draw of a robot or a door: shapes, joints, poses and colours."""
