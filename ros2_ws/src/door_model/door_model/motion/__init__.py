"""How a door moves by eq. (1): free, pushed, to its peak, and where its energy goes."""
