"""The page in the browser: server, what it draws, and its panels. Nothing here knows ROS."""
