"""Readers of weight fields in files: CSV, and NumPy arrays without pickled objects."""

import io
import zipfile
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ..coverage.definitions.errors import UserError, unusable
from ..coverage.weight_field import MOST_CELLS

KINDS = (".csv", ".npy", ".npz")
_LARGEST = 16 * 2**20  # bytes of an array in an archive


def weight_rows(where: str, path: Path, data: bytes) -> tuple[list[str], int | None]:
    """Return the rows of a weight field's file, and its number of layers if the file states it.

    A CSV file holds the rows themselves; blank lines and lines that begin with # are skipped. An
    array has the shape (X, Y) or (X, Y, Z).

    Args:
        where: file and key that name it, for messages.
        path: the file.
        data: its content.

    Raises:
        UserError: if it holds no grid of weights.
    """
    kind = path.suffix.lower()
    if kind not in KINDS:
        raise unusable(where, path.name, ", ".join(KINDS))
    try:
        if kind == ".csv":
            lines = [line.strip() for line in data.decode("utf-8-sig").splitlines()]
            return [line for line in lines if line and not line.startswith("#")], None
        array = _array(data if kind == ".npy" else _member(data))
    except (ValueError, OSError, KeyError, zipfile.BadZipFile, EOFError) as error:
        raise UserError(f"{where}: {path}: {error}; allowed: a grid of weights") from error
    array = array[..., None] if array.ndim == 2 else array
    flat = array.transpose(2, 1, 0).reshape(-1, array.shape[0])
    return [" ".join(f"{weight:.9g}" for weight in row) for row in flat], array.shape[2]


def _member(data: bytes) -> bytes:
    """Return the only array of an archive, or the one called weights."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        names = archive.namelist()
        name = names[0] if len(names) == 1 else "weights.npy"
        if name not in names:
            raise ValueError(f"found {len(names)} arrays, none of them called weights")
        if archive.getinfo(name).file_size > _LARGEST:
            raise ValueError(f"the array is larger than {_LARGEST // 2**20} MB")
        with archive.open(name) as member:
            return member.read(_LARGEST)


def _array(data: bytes) -> Float[np.ndarray, "..."]:
    """Return the array of a NumPy file; its header is checked before anything is allocated."""
    file = io.BytesIO(data)
    version = np.lib.format.read_magic(file)
    read = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }.get(version)
    if read is None:
        raise ValueError(f"found version {version} of the NumPy format")
    shape, _, dtype = read(file)
    if dtype.kind not in "buif":
        raise ValueError(f"found values of type {dtype}, not numbers")
    cells = 1
    for length in shape:
        cells *= length
    if len(shape) not in (2, 3) or not 0 < cells <= MOST_CELLS:
        raise ValueError(
            f"found shape {shape}; the limits are 2 or 3 dimensions and {MOST_CELLS} cells"
        )
    array: np.ndarray = np.load(io.BytesIO(data), allow_pickle=False)
    return array.astype(float)
