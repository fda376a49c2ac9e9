"""Picture of a page's view on white, with a legend below."""

import io

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

from .colours import KINDS

_STRIP, _MARGIN, _SIZE = 84, 16, 20  # pixels


def view_picture(view: UInt8[np.ndarray, "H W 4"], title: str, line: str) -> bytes:
    """Return a PNG of a view with title, coverage and legend.

    Args:
        view: pixels with opacity.
        title: title.
        line: coverage of the targets.
    """
    seen = Image.fromarray(view, "RGBA")
    sheet = Image.new("RGB", (seen.width, seen.height + _STRIP), "white")
    sheet.paste(seen, (0, 0), seen)
    pen, large = ImageDraw.Draw(sheet), ImageFont.load_default(_SIZE)
    pen.text((_MARGIN, seen.height + 6), f"{title}    {line}", fill="#23272b", font=large)
    x = _MARGIN
    for kind in KINDS:
        words = kind.words.split(":")[0]
        pen.ellipse((x, seen.height + 49, x + 12, seen.height + 61), fill=kind.colour)
        pen.text((x + 18, seen.height + 44), words, fill="#666d75", font=ImageFont.load_default(16))
        x += 42 + int(pen.textlength(words, font=ImageFont.load_default(16)))
    data = io.BytesIO()
    sheet.save(data, "PNG", optimize=True)
    return data.getvalue()
