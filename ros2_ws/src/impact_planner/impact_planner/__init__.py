"""Planning and execution of a whole-body impact that opens a heavy swing door."""
