"""The robot's driver as its topics show it: messages, their checks, and the watch over them."""
