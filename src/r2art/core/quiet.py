"""Silence for native libraries that write to stderr behind Python's back."""

import contextlib
import os
from collections.abc import Iterator


@contextlib.contextmanager
def stderr_closed() -> Iterator[None]:
    """Drop what the process, or any library in it, writes to stderr meanwhile.

    For calls whose failure shows otherwise: NVIDIA Warp tells every process of a machine without
    a GPU that it has none.
    """
    try:
        kept = os.dup(2)
    except OSError:  # there is no stderr to begin with
        yield
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    os.close(nowhere)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
