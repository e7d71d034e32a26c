"""The online state of a joint: init, step, peek, snapshot, bounds, erasing history."""

from cablecomp.observer.observer import Observer, WrapProfile

__all__ = ["Observer", "WrapProfile"]
