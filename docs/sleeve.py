"""Draw the probability that one frame reports a dark sleeve, over its distance, for three sensors.

Run: python docs/sleeve.py [FILE]
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import place_rings as pr
from place_rings.coverage.detection.detected_range import along
from place_rings.coverage.detection.detection import bounds, detectors

ASKED = 0.9  # m
COLOURS = {"vl53l5cx-4x4": "#0072b2", "vl53l5cx": "#009e73", "vl53l7cx": "#d55e00"}
DISTANCES = np.geomspace(0.03, 3.0, 240)  # m


def draw(file: Path) -> None:
    """Write the picture: daylight above, the dark below."""
    figure, panels = plt.subplots(2, 1, figsize=(7.5, 5.4), sharex=True, layout="constrained")
    for ax, light in zip(panels, ("5klx", "dark"), strict=True):
        question = pr.Detection("arm", ambient=light)
        for name, colour in COLOURS.items():
            of = [detectors([pr.sensors[name]], question), *bounds([pr.sensors[name]], question)]
            middle, low, high = ([along(each, question, d)[0] for d in DISTANCES] for each in of)
            ax.plot(DISTANCES, middle, color=colour, lw=2, label=name)
            ax.fill_between(DISTANCES, low, high, color=colour, alpha=0.18, lw=0)
        ax.axvline(ASKED, color="#7d8791", lw=1, ls="--")
        ax.text(ASKED * 1.03, 0.9, f"{ASKED:g} m", color="#4a525a", fontsize=9)
        ax.set_title({"5klx": "in 5 klx"}.get(light, "in the dark"), loc="left", fontsize=10)
        ax.set_ylabel("share of frames", fontsize=9)
        ax.set_ylim(0, 1.02)
    panels[0].legend(frameon=False, fontsize=9, loc="upper right")
    panels[1].set_xscale("log")
    ticks = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0)
    panels[1].set_xticks(ticks, [f"{t:g}" for t in ticks])
    panels[1].minorticks_off()
    panels[1].set_xlabel("distance of a sleeve of 1.8 %, 80 × 400 mm, m", fontsize=9)
    for ax in panels:
        ax.spines[["top", "right"]].set_visible(False)
    figure.savefig(file, dpi=110)


if __name__ == "__main__":
    here = Path(__file__).with_name("sleeve.png")
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else here)
