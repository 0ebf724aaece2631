"""Motion of a door by eq. (1): simulated, free or driven, its peak, and its energy balance."""
