"""The demonstration: it identifies a door, opens it by a hit and reports the result."""
