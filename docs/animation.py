"""Draw the animated picture of the README: the best setup while a search runs, then its answer in
the viewer. It needs Chromium and the extra ``test``.

Run: python docs/animation.py [FILE]
"""

import sys
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import place_rings as pr
from PIL import Image
from place_rings.reporting.placement_picture import placement_picture
from screenshots import DOCS, viewed

SIZE = (900, 500)  # pixels
PAGE = (1080, 600)  # pixels of the viewer's page
QUALITY = 85  # of WebP
STATE, ANSWER, OPENED, TURNED, LAST = 700, 2400, 1500, 250, 3000  # ms, durations of frames
TURNS = (10, 20, 30, 40, 30, 20, 10, 0)  # pixels of the mouse, frame by frame
DRAWN = 3_000  # ms, time for one of them without a graphics card

Frame = tuple[Image.Image, int]
"""A picture, and its duration in ms."""


def fitted(picture: Image.Image) -> Image.Image:
    """Return a picture of the animation's size, with white around it."""
    picture.thumbnail(SIZE, Image.Resampling.LANCZOS)
    frame = Image.new("RGB", SIZE, "white")
    frame.paste(
        picture, tuple((whole - own) // 2 for whole, own in zip(SIZE, picture.size, strict=True))
    )
    return frame


def searched(scene: pr.Scene) -> tuple[list[Frame], pr.Setup]:
    """Return a frame for each setup that was the best so far, and for the answer; and the answer.

    The search is that of the first command, with a fifth of the usual candidates.
    """
    states: list[tuple[pr.Setup, float]] = []

    def tell(progress: pr.Progress) -> None:
        if progress.setup is not None and (not states or states[-1][0] != progress.setup):
            states.append((progress.setup, progress.best))

    result = pr.search(scene, effort=0.2, voxel=0.02, progress=tell)
    texts = [f"searching: {100 * best:.1f} % of V_S(0.5) covered" for _, best in states]
    texts += [f"found: {100 * result.coverage:.1f} % of V_S(0.5) covered"]
    setups = [*(setup for setup, _ in states), result.setup]
    frames = []
    with TemporaryDirectory() as folder:
        for setup, text in zip(setups, texts, strict=True):
            placement_picture(path := Path(folder, "state.png"), scene, setup, [text])
            frames.append((fitted(Image.open(path)), STATE))
    return [*frames[:-1], (frames[-1][0], ANSWER)], result.setup


def turned(scene: pr.Scene, setup: pr.Setup) -> list[Frame]:
    """Return frames of a setup in the viewer, while the mouse turns the view."""
    frames = []
    with viewed(setup, scene, PAGE) as tab:

        def taken(milliseconds: int) -> None:
            frames.append((fitted(Image.open(BytesIO(tab.screenshot()))), milliseconds))

        taken(OPENED)
        x, y = 400, 500
        tab.mouse.move(x, y)
        tab.mouse.down()
        for turn in TURNS:
            tab.mouse.move(x - turn, y, steps=2)
            tab.wait_for_timeout(DRAWN)
            taken(TURNED)
    return [*frames[:-1], (frames[-1][0], LAST)]


def main() -> None:
    """Write the animation."""
    scene = pr.Scene(targets=[pr.Shell(0.5)])
    search, answer = searched(scene)
    pictures, durations = zip(*search, *turned(scene, answer), strict=True)
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS / "search.webp"
    first, *others = pictures
    options = {"duration": list(durations), "loop": 0, "quality": QUALITY, "method": 6}
    first.save(out, save_all=True, append_images=others, **options)


if __name__ == "__main__":
    main()
