"""Process in which SciPy reads a MATLAB file: a file may crash its parser, or claim more memory
than there is.

Run: python -m place_rings.formats.layouts.mat_process VARIABLE ROW

The process reads the file from stdin, and writes to stdout a line, and after "ok" the transforms
(N, 4, 4) in NumPy's format. ROW counts from 1; 0: the variable has no rows.
"""

import io
import sys
from typing import Any

import numpy as np

from ..limited_process import limit, say_array

_BYTES = 1 << 30  # of memory
_SECONDS = 5  # of processor time


def main() -> None:
    """Write the transforms, or why there are none."""
    limit(_BYTES, _SECONDS)
    variable, row = sys.argv[1], int(sys.argv[2])
    try:
        frames: Any = _frames(sys.stdin.buffer.read(), variable, row)
    except Exception as error:  # whatever a parser of a broken file raises
        frames = f"a file that is no MATLAB file ({type(error).__name__})"
    if isinstance(frames, str):
        sys.stdout.buffer.write(frames.encode())
        return
    sys.stdout.buffer.write(b"ok\n")
    say_array(frames)


def _frames(data: bytes, variable: str, row: int) -> Any:
    """Return the transforms (N, 4, 4) of a variable, or what is there instead."""
    from scipy.io import loadmat

    content: dict[str, Any] = loadmat(io.BytesIO(data), variable_names=[variable])
    if variable not in content or variable.startswith("__"):
        return "no such variable"
    cells = content[variable]
    if row:
        rows = list(np.ravel(cells)) if np.asarray(cells).dtype == object else []
        if row > len(rows):
            return f"row {row} of 1 to {len(rows)}"
        cells = rows[row - 1]
    each = list(np.ravel(cells)) if np.asarray(cells).dtype == object else [cells]
    if not each or not all(_is_matrix(T) for T in each):
        return "values that are no transforms (4, 4)"
    return np.array(each, float)


def _is_matrix(T: Any) -> bool:
    return isinstance(T, np.ndarray) and T.shape == (4, 4) and T.dtype.kind in "fiu"


if __name__ == "__main__":
    main()
