"""From raw counts to checked angles and velocities."""
