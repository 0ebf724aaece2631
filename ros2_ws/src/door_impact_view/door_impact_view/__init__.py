"""Robot and door in a browser: live, and as a replay."""
