"""Labelled photos of one category, wherever they come from."""

from typing import Protocol

from r2art.core.category import Category
from r2art.core.errors import InputError
from r2art.data.sample import Sample


class Fault(InputError):
    """Something wrong in a dataset: which file, which field of it, and what.

    Attributes:
        file: The file, as short as it stays clear.
        field: Name of the column, key or array in it; ``""``: the file as a whole.
        problem: What is wrong and what would be right, in a few words.
    """

    def __init__(self, file: str, field: str, problem: str) -> None:
        self.file, self.field, self.problem = file, field, problem
        super().__init__(f"{file}: {field}: {problem}" if field else f"{file}: {problem}")


class Source(Protocol):
    """A dataset opened for reading, sample by sample."""

    @property
    def category(self) -> Category:
        """What its photos show."""
        ...

    def __len__(self) -> int: ...

    def __getitem__(self, index: int) -> Sample:
        """One labelled photo.

        Raises:
            Fault: It cannot be read.
        """
        ...

    def file(self, index: int) -> str:
        """Where the labels of a sample stand: file, and row where a file holds several."""
        ...
