"""The commands `plan` and `impact_map`, with their texts and figures."""
