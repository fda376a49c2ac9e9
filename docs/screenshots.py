"""Draw the pictures of the pages that the toolkit itself makes: its outputs, and the viewer.

The picture of a robot needs the extra ``robots``, that of the viewer Chromium and the extra
``test``.

Run: python docs/screenshots.py [placement | ring | lids | assembled_ur10 | viewer | ...] ...
"""

import base64
import math
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import place_rings as pr

DOCS = Path(__file__).parent
SIZE = (1200, 760)  # pixels of the viewer's page
FLAGS = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
DRAWN = 20_000  # ms, time for the first picture without a graphics card


def command(*words: str) -> None:
    """Run place-rings."""
    subprocess.run([sys.executable, "-m", "place_rings.cli.entry", *words], check=True)


def placement(folder: Path) -> Path:
    """Draw the proposal of the first command."""
    command("--target", "V_S", "--radius", "0.5", "--out", str(folder))
    return folder / "placement.png"


def ring(folder: Path) -> Path:
    """Draw a printed ring with its boards."""
    scene = pr.Scene(sensor=pr.sensors["vl53l4cd"])
    one = scene.ring("forearm", 0.9, 12, tilt=math.radians(-45), phase=math.radians(15))
    pr.export(pr.Setup([one]), scene, to="stl", folder=folder)
    return folder / "mounted.png"


def lids(folder: Path) -> Path:
    """Draw a printed ring whose boards have lids."""
    (folder / "scene.toml").write_text('[sensor]\nmodel = "vl53l5cx"\n[printing]\ncover = true\n')
    scene = pr.load(folder / "scene.toml")
    one = scene.ring("forearm", 0.8, 8, tilt=math.radians(-40), phase=math.radians(22))
    pr.export(pr.Setup([one]), scene, to="stl", folder=folder)
    return folder / "mounted.png"


def parts(folder: Path) -> Path:
    """Draw a ring in three parts for a small printer, its boards far from the link."""
    (folder / "scene.toml").write_text(
        'ring_radius = 0.13\n[sensor]\nmodel = "vl53l4cd"\n'
        '[printing]\nfastening = "insert"\nbed_mm = [140, 140, 200]\n'
    )
    scene = pr.load(folder / "scene.toml")
    one = scene.ring("forearm", 0.7, 3, tilt=math.radians(23), phase=math.radians(15))
    pr.export(pr.Setup([one]), scene, to="stl", folder=folder)
    return folder / "ring0_forearm.png"


def assembled(name: str, rings: int, sensors: int) -> Callable[[Path], Path]:
    """Return a function that draws a robot with the printed rings of a proposal."""

    def drawn(folder: Path) -> Path:
        scene = ("--robot", name, "--target", "V_S", "--radius", "0.5")
        budget = ("--sensor", "vl53l4cd", "--rings", str(rings), "--sensors", str(sensors))
        command(*scene, *budget, "--voxel", "0.02", "--out", str(folder))
        command("export", str(folder / "proposal.toml"), "--to", "stl", "--out", str(folder))
        return folder / "assembled.png"

    return drawn


def wiring(folder: Path) -> Path:
    """Draw the wiring of a ring of sixteen sensors."""
    pr.export("n2_16_25", to="firmware", folder=folder)
    return folder / "ring0_upper_arm" / "wiring.png"


def robot(folder: Path) -> Path:
    """Draw a robot from its URDF."""
    site = Path(sysconfig.get_paths()["purelib"])
    data = site / "cmeel.prefix" / "share" / "example-robot-data" / "robots"
    urdf, packages = data / "xarm_description" / "urdf" / "xarm7.urdf", data.parent.parent
    command("robot", str(urdf), "--packages", str(packages), "--out", str(folder))
    return folder / "robot.png"


@contextmanager
def viewed(setup: str | pr.Setup, scene: pr.Scene, size: tuple[int, int]) -> Iterator[Any]:
    """Open the viewer's page in Chromium; yield Playwright's tab when it is drawn."""
    from playwright.sync_api import sync_playwright

    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    with (
        pr.view(setup, scene, browser=False, wait=False) as page,
        sync_playwright() as playwright,
    ):
        browser = playwright.chromium.launch(executable_path=chromium, args=list(FLAGS))
        tab = browser.new_page(viewport={"width": size[0], "height": size[1]})
        tab.goto(page.url)
        tab.get_by_text("ζ in %").first.wait_for()
        tab.wait_for_timeout(DRAWN)
        for notice in tab.locator(".mantine-Notification-closeButton").all():
            notice.click()  # of drawing without a graphics card
        tab.wait_for_timeout(1000)
        yield tab
        browser.close()


def viewer(folder: Path) -> Path:
    """Take a picture of the viewer's page."""
    scene = pr.Scene(targets=[pr.Shell(0.5), pr.Shell(1.5), pr.ReachAndToolSpheres()])
    with viewed("n3_16_55", scene, SIZE) as tab:
        tab.screenshot(path=folder / "viewer.png")
    return folder / "viewer.png"


def dossier(folder: Path) -> Path:
    """Take the plan view out of a dossier's page."""
    with (folder / "task.csv").open("w") as file:
        words = [sys.executable, "-m", "place_rings.cli.entry", "task"]
        subprocess.run(words, stdout=file, check=True)
    motion = ("--trajectory", str(folder / "task.csv"), "--paper", "--approaches", "24")
    light = ("--sensor", "vl53l1x", "--ambient", "dark")
    command("safety", "n3_16_55", *motion, *light, "--dossier", "--out", str(folder))
    page = (folder / "dossier.html").read_text("utf-8")
    _, _, image = page.partition("data:image/png;base64,")
    (folder / "dossier.png").write_bytes(base64.b64decode(image.partition('"')[0]))
    return folder / "dossier.png"


PICTURES: dict[str, Callable[[Path], Path]] = {
    "placement": placement,
    "ring": ring,
    "lids": lids,
    "parts": parts,
    "assembled_ur10": assembled("ur10", 5, 50),
    "assembled_ur5e": assembled("ur5e", 5, 50),
    "assembled_panda": assembled("panda", 3, 24),
    "wiring": wiring,
    "robot": robot,
    "viewer": viewer,
    "dossier": dossier,
}


def main() -> None:
    """Draw the requested pictures, or all."""
    for name in sys.argv[1:] or PICTURES:
        with TemporaryDirectory() as folder:
            shutil.copyfile(PICTURES[name](Path(folder)), DOCS / f"{name}.png")


if __name__ == "__main__":
    main()
