"""Many arrays handed to a compiled kernel as one table of addresses.

Each array argument costs a call from Python some 60 ns, a nested tuple of them twice that; a
kernel that works on a hundred arrays would spend most of its time on being called. So their
addresses and shapes are written down once, in one table of integers, and the kernel makes
its views from that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import numba
import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np import arrayobj, numpy_support

from motm_wbc.geometry.arrays import IntArray

Tree = TypeVar("Tree", bound=tuple[Any, ...])
_TYPES = {"f": np.float64, "i": np.int64, "b": np.bool_, "c": np.int8}


def prototype(kind: type[Tree], dimensions: str) -> Tree:
    """A named tuple of empty arrays.

    Args:
        kind: the named tuple's class.
        dimensions: for each array a letter, f for floats, i for integers, b for flags, c for
            codes of one byte, and its number of dimensions: `"f2 i1"`.
    """
    return kind(*(np.empty((0,) * int(item[1:]), _TYPES[item[0]]) for item in dimensions.split()))


class AddressTable:
    """Addresses and shapes of all arrays in nested named tuples, for one kind of tuple.

    The arrays must live as long as the table is in use: keep the tuple.

    Args:
        like: nested named tuples of arrays with the right types and numbers of dimensions.
    """

    def __init__(self, like: tuple[Any, ...]) -> None:
        self._like = [(array.ndim, array.dtype) for array in _leaves(like)]

    def write(self, tree: tuple[Any, ...]) -> IntArray:
        """The table for arrays of the prototype's kind.

        Raises:
            TypeError: an array has another type or number of dimensions, or is not in C order.
        """
        table: list[int] = []
        for array, like in zip(_leaves(tree), self._like, strict=True):
            if (array.ndim, array.dtype) != like or not array.flags.c_contiguous:
                raise TypeError(
                    f"an array is {array.ndim}-d of {array.dtype}, needs {like}, C order"
                )
            table += [array.ctypes.data, *array.shape]
        return np.array(table, dtype=np.int64)


def reader(like: Tree) -> Callable[[IntArray], Tree]:
    """A function, for use in kernels only, that turns a table back into named tuples of arrays.

    Args:
        like: as for `AddressTable`.
    """
    kind = numba.typeof(like)

    @intrinsic  # type: ignore[untyped-decorator]
    def read(_typing: Any, table: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            numbers = arrayobj.make_array(signature.args[0])(context, builder, arguments[0]).data
            return _Views(context, builder, numbers).make(kind)

        return kind(table), generate

    return read  # type: ignore[no-any-return]


def _leaves(tree: tuple[Any, ...]) -> Iterator[Any]:
    for item in tree:
        if isinstance(item, tuple):
            yield from _leaves(item)
        else:
            yield item


class _Views:
    """Writes the machine code that makes views of memory from a table, entry by entry."""

    def __init__(self, context: Any, builder: Any, numbers: Any) -> None:
        self._context, self._builder, self._numbers = context, builder, numbers
        self._place = 0

    def make(self, kind: Any) -> Any:
        """Views of one type: an array, or a tuple of such."""
        if isinstance(kind, types.BaseTuple):
            items = [self.make(item) for item in kind.types]
            return self._context.make_tuple(self._builder, kind, items)
        context, builder = self._context, self._builder
        address = self._next()
        shape = [self._next() for _ in range(kind.ndim)]
        size = numpy_support.as_dtype(kind.dtype).itemsize
        itemsize = context.get_constant(types.intp, size)
        strides = [itemsize]
        for extent in reversed(shape[1:]):
            strides.insert(0, builder.mul(strides[0], extent))
        array = arrayobj.make_array(kind)(context, builder)
        arrayobj.populate_array(
            array,
            data=builder.inttoptr(address, array.data.type),
            shape=shape,
            strides=strides,
            itemsize=itemsize,
            meminfo=None,
        )
        return array._getvalue()

    def _next(self) -> Any:
        """The next number of the table."""
        pointer = cgutils.gep_inbounds(self._builder, self._numbers, self._place)
        self._place += 1
        return self._builder.load(pointer)
