"""The explorer: a page on the loopback address to plan gaits by hand, and its server."""
