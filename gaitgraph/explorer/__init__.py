"""The explorer: a page on the loopback address to plan gaits by hand, and its server."""

__all__: list[str] = []


def __dir__() -> list[str]:
    return __all__
