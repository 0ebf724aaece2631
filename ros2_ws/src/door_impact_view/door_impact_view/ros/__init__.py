"""The node door_impact_view: topics to what is drawn, buttons to services and actions."""
