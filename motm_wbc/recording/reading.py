"""Reading a recording back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from motm_wbc.errors import InputError, UnknownName
from motm_wbc.recording.timeline import NAME


def entities(path: Path) -> dict[str, int]:
    """Paths of all entities, with the number of rows that the time line has of each.

    Zero is an entity that holds at all times.

    Raises:
        InputError: the file is no recording.
    """
    counts: dict[str, int] = {}
    for chunk in _reader(path).stream():
        rows = 0 if chunk.is_static else chunk.num_rows
        counts[chunk.entity_path] = counts.get(chunk.entity_path, 0) + rows
    return counts


def rows(path: Path, entity: str) -> Any:
    """What the time line has of one entity, as a `pyarrow.Table` ordered by time.

    Args:
        path: the recording.
        entity: path of the entity, for example `/series/tool_error/value`.

    Raises:
        InputError: the file is no recording.
        UnknownName: it has no such entity on the time line.
    """
    import pyarrow as pa

    stream = _reader(path).stream().filter(content=entity, has_timeline=NAME)
    batches = [chunk.to_record_batch() for chunk in stream]
    if not batches:
        moving = [name for name, count in entities(path).items() if count]
        raise UnknownName("entity", entity, moving, str(path))
    names = batches[0].schema.names
    table = pa.concat_tables(pa.Table.from_batches([batch]).select(names) for batch in batches)
    return table.sort_by(NAME)


def has_blueprint(path: Path) -> bool:
    """Whether the recording brings its own views.

    Raises:
        InputError: the file is no recording.
    """
    return bool(_reader(path).blueprints())


def _reader(path: Path) -> Any:
    from rerun.chunk import RrdReader

    try:
        return RrdReader(path)
    except Exception as error:
        raise InputError(f"can't be read as a recording: {error}", str(path)) from None
