"""The way through a door whose leaf the hand keeps open."""
