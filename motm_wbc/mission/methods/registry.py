"""Methods by name: the shipped ones, and those that installed packages announce."""

from __future__ import annotations

from importlib.metadata import EntryPoint, entry_points

from motm_wbc.errors import InputError, UnknownName
from motm_wbc.mission.methods.method import Method, MethodContext
from motm_wbc.mission.methods.proposed import Proposed

ENTRY_POINT_GROUP = "motm_wbc.methods"
_SHIPPED: dict[str, type[Method]] = {"proposed": Proposed}


def method_names() -> list[str]:
    """Names of all methods that can be run here."""
    return sorted({*_SHIPPED, *(point.name for point in entry_points(group=ENTRY_POINT_GROUP))})


def new_method(name: str, context: MethodContext) -> Method:
    """A fresh instance of a method.

    Raises:
        InputError: there is none of that name, or its package can't be loaded.
    """
    if name in _SHIPPED:
        return _SHIPPED[name](context)
    for point in entry_points(group=ENTRY_POINT_GROUP):
        if point.name == name:
            return _load(point)(context)
    raise UnknownName("method", name, method_names(), "--method")


def _load(point: EntryPoint) -> type[Method]:
    try:
        found: type[Method] = point.load()
    except (ImportError, AttributeError) as error:
        raise InputError(f"can't be loaded: {error}", f"method {point.name!r}") from None
    return found
