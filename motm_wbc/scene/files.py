"""TOML files into checked data, with one clear line for whatever is wrong."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails

from motm_wbc.errors import InputError


class Data(BaseModel):
    """Base of all data read from files: frozen, no unknown keys, finite numbers only."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True
    )


Model = TypeVar("Model", bound=BaseModel)


def read_text(path: Path) -> str:
    """The content of a text file.

    Raises:
        InputError: the file is missing or unreadable.
    """
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError("no such file", str(path)) from None
    except IsADirectoryError:
        raise InputError("is a folder, a file is needed", str(path)) from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"can't be read: {error}", str(path)) from None


def read_toml(path: Path) -> dict[str, Any]:
    """The file's content as nested dictionaries.

    Raises:
        InputError: the file is missing, unreadable or no TOML.
    """
    try:
        return tomllib.loads(read_text(path))
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"is not valid TOML: {error}", str(path)) from None


def parse(model: type[Model], content: Mapping[str, Any], where: str) -> Model:
    """The content as an instance of `model`.

    Raises:
        InputError: names the file, the key and what would be legal.
    """
    try:
        return model.model_validate(content)
    except ValidationError as error:
        raise _as_input_error(error, model, where) from None


def _as_input_error(error: ValidationError, model: type[BaseModel], where: str) -> InputError:
    # a misspelt key is also a missing one: the misspelling says more
    first = min(error.errors(), key=lambda one: one["type"] != "extra_forbidden")
    location = [part for part in first["loc"] if not _is_tag(part)]
    key = _key(location)
    if first["type"] == "extra_forbidden":
        legal = _fields_beside(model, first["loc"])
        name = str(location[-1])
        near = difflib.get_close_matches(name, legal, n=1, cutoff=0.5)
        hint = f", did you mean {near[0]!r}?" if near else ""
        return InputError(f"unknown key{hint} (legal: {', '.join(legal)})", f"{where}: {key}")
    message = first["msg"].removeprefix("Value error, ")
    return InputError(message[0].lower() + message[1:] + _given(first), f"{where}: {key}")


def _given(detail: ErrorDetails) -> str:
    """The value at fault, where it is a plain one."""
    value = detail["input"]
    plain = isinstance(value, str | int | float | bool)
    return f" (got {value!r})" if plain and detail["type"] != "missing" else ""


def _is_tag(part: int | str) -> bool:
    return isinstance(part, str) and part.startswith("kind=")


def _key(location: Sequence[int | str]) -> str:
    """`obstacles[0].size` for ("obstacles", 0, "size")."""
    text = ""
    for part in location:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            text += f".{part}" if text else str(part)
    return text or "the file"


def _fields_beside(model: type[BaseModel], location: Sequence[int | str]) -> list[str]:
    """Names of the keys that are legal where the last key of `location` stands."""
    current: Any = model
    for part in location[:-1]:
        if isinstance(part, int):
            continue
        current = _model_of(current, part)
        if current is None:
            return []
    return sorted(field.alias or name for name, field in current.model_fields.items())


def _model_of(model: type[BaseModel], key: str) -> type[BaseModel] | None:
    field = model.model_fields.get(key)
    if field is None:
        field = next((f for f in model.model_fields.values() if f.alias == key), None)
    return _find_model(field.annotation) if field is not None else None


def _find_model(annotation: Any) -> type[BaseModel] | None:
    """The first data model inside an annotation such as `tuple[Solid, ...] | None`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in getattr(annotation, "__args__", ()):
        found = _find_model(argument)
        if found is not None:
            return found
    return None
