"""Mobile manipulation on the move, with failure recovery."""

from motm_wbc._version import __version__

__all__ = ["__version__"]
