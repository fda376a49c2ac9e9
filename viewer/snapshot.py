"""A page's view as a picture: over white, with a line of words below."""

import io

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

from .colours import KINDS

_STRIP, _MARGIN, _SIZE = 84, 16, 20  # pixels


def picture(view: UInt8[np.ndarray, "H W 4"], title: str, line: str) -> bytes:
    """A PNG of a view with see-through background, of a title, a line of figures and the colours in
    words.
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
