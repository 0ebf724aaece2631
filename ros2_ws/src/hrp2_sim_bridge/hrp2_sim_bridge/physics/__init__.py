"""Robot and door in a physics engine, behind the interface `engine.py`."""
