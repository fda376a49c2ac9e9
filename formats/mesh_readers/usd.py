"""Reader of the surfaces in OpenUSD files (.usd, .usda, .usdc), by a process of its own."""

import io
import json
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from jaxtyping import Float

from ..limited_process import answer_of
from .mesh_numbers import AGAIN, MeshError

_STARTS = {b"#usda": "stage.usda", b"PXR-USDC": "stage.usdc"}


Triangles = Float[np.ndarray, "T 3 3"]


def usd_parts(data: bytes) -> dict[str, Triangles | MeshError]:
    """Return the triangles (T, 3, 3) m of each part of a stage in a frame that is z-up, or why the
    part cannot be read.

    A part is a prim with a surface that is neither invisible nor a guide. Its name is its path,
    without the first /.

    Raises:
        MeshError: if it cannot be read, names other files, or has too many triangles.
    """
    name = next((name for start, name in _STARTS.items() if data.startswith(start)), None)
    if name is None:
        raise MeshError(f"OpenUSD in text or binary (.usda, .usdc); {AGAIN}")
    with TemporaryDirectory() as folder:
        file = Path(folder, name)
        file.write_bytes(data)
        said, _, rest = answer_of(f"{__package__}.usd_process", str(file)).partition(b"\n")
    if said == b"refused":
        raise MeshError(rest.decode(errors="replace"))
    if said != b"ok":
        raise MeshError(f"OpenUSD that can be read (found {said.decode(errors='replace')})")
    head, _, numbers = rest.partition(b"\n")
    names, ends, refused = json.loads(head)
    triangles = np.load(io.BytesIO(numbers), allow_pickle=False)
    spans = zip(names, pairwise([0, *ends]), strict=True)
    parts: dict[str, Triangles | MeshError] = {part: triangles[i:j] for part, (i, j) in spans}
    return parts | {part: MeshError(why) for part, why in refused.items()}
