"""Arrays from ``.npz`` files, also from pickled dictionaries, without trusting the pickle."""

import io
import pickle
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from r2art.data.source import Fault

# All that a pickled NumPy array is made of, under its names in NumPy 1 and 2.
ALLOWED = {
    *((f"numpy.{core}.multiarray", "_reconstruct") for core in ("core", "_core")),
    *((f"numpy.{core}.multiarray", "scalar") for core in ("core", "_core")),
    *((f"numpy.{core}.numeric", "_frombuffer") for core in ("core", "_core")),
    ("numpy", "ndarray"),
    ("numpy", "dtype"),
    ("_codecs", "encode"),
}


class _ArraysOnly(pickle.Unpickler):
    """Unpickles arrays and plain containers; anything else is refused, never imported."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in ALLOWED:
            raise pickle.UnpicklingError(f"it wants {module}.{name}, which no array needs")
        return super().find_class(module, name)


def read_arrays(path: Path, names: tuple[str, ...]) -> dict[str, NDArray[Any]]:
    """The named arrays of an ``.npz`` file, or of the dictionary that is its only content.

    Raises:
        Fault: It is missing, damaged, holds other objects than arrays, or lacks one of them.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            content = {n.removesuffix(".npy"): _array(archive.read(n)) for n in archive.namelist()}
        if list(content) == ["arr_0"] and content["arr_0"].dtype == object:
            content = content["arr_0"].item()
    except FileNotFoundError:
        raise Fault(str(path), "", "is missing") from None
    except Exception as error:  # damaged zips, headers and pickles raise whatever they trip over
        reason = " ".join(str(error).split()) or type(error).__name__
        raise Fault(str(path), "", f"holds no arrays that can be read ({reason})") from None
    if not isinstance(content, Mapping):
        raise Fault(str(path), "", "must hold a dictionary of arrays")
    return {name: _numbers(path, content, name) for name in names}


def _array(content: bytes) -> NDArray[Any]:
    file = io.BytesIO(content)
    version = npy.read_magic(file)
    read_header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    _, _, dtype = read_header(file)
    if not dtype.hasobject:
        return np.load(io.BytesIO(content), allow_pickle=False)
    return np.asarray(_ArraysOnly(file).load(), object)


def _numbers(path: Path, content: Mapping[str, Any], name: str) -> NDArray[Any]:
    if name not in content:
        raise Fault(str(path), name, "is missing")
    array = np.asarray(content[name])
    if array.dtype.kind not in "biuf":
        raise Fault(str(path), name, f"must hold numbers, is of type {array.dtype}")
    if not np.isfinite(array).all():
        raise Fault(str(path), name, "holds a NaN or an infinity")
    return array
