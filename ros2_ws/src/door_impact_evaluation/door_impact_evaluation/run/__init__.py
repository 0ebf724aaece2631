"""One run of the whole system: its record, its log and what is measured of it."""
