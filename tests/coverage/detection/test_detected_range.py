"""Distances of detection, computed again from the printed figures by code that shares none."""

import json
import math
import sys

import pytest
from place_rings.cli.app import main

from tests.support.refusals import refused

PIECES = ("hand", "arm", "leg", "torso", "person", "rod-14", "rod-40", "rod-70")


def printed(capsys, *words):
    sys.argv = ["place-rings", "sensors", *words]
    with pytest.raises(SystemExit) as stop:
        main()
    assert not stop.value.code
    return capsys.readouterr().out


def cumulative(x):
    return math.erfc(-x / math.sqrt(2)) / 2


def solve(function, low, high):
    """Return where a falling function is 0."""
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if function(middle) > 0 else (low, middle)
    return low


def quantile(figures):
    """Return the quantile of the share of frames at the printed range."""
    b, rate = figures["threshold"], figures["share of frames at that range"]
    return solve(lambda z: rate + (1 - rate) * cumulative(-b) - cumulative(z), -9, 9)


def chance(figures, distance):
    """Return the share of frames by the printed figures, for a piece with its front there."""
    b, z = figures["threshold"], figures["z"]
    size = [figures["width of the piece"], figures["height of the piece"]]
    half = [math.tan(math.radians(figures["full angle along the ring"]) / 2)] * 2
    if "full angle along its axis" in figures:
        half[1] = math.tan(math.radians(figures["full angle along its axis"]) / 2)
    else:  # a square as large as the disc
        half = [h * math.sqrt(math.pi) / 2 for h in half]
    zones = figures["zones in a row"], figures["rows of zones"]
    depth = distance + size[0] / 2
    aside = [max(t * depth - w / 2, 0.0) for t, w in zip(offset(half, zones), size, strict=True)]
    s = figures["R"] ** 2 / (distance**2 + sum(a * a for a in aside))
    for w, h, n in zip(size, half, zones, strict=True):
        s *= min(1.0, w / depth * n / (2 * h))
    return 1 - cumulative(b - s * (b + z)) / cumulative(b)


def offset(half, zones):
    """Return the tangents of the middle of the zone nearest to the axis."""
    return [h / n if n % 2 == 0 else 0.0 for h, n in zip(half, zones, strict=True)]


PAIRS = [
    pytest.param(piece, reflectance, marks=[pytest.mark.slow] * ((i + k) % 3 > 0))
    for i, piece in enumerate(PIECES)
    for k, reflectance in enumerate((0.018, 0.17, 0.88))
]


@pytest.mark.parametrize(("piece", "reflectance"), PAIRS)
def test_distances_follow_from_the_printed_figures(capsys, piece, reflectance):
    words = ("--detect", piece, "--reflectance", str(reflectance), "--json")
    for record in json.loads(printed(capsys, *words)):
        figures = {row["figure"]: row["value"] for row in record["basis"]}
        figures["R"] = [v for name, v in figures.items() if name.startswith("range, ")][-1]
        figures["z"] = quantile(figures)
        for distance in record["distances"]:
            d = solve(lambda d: chance(figures, d) - distance["share"], 1e-4, 1000.0)  # noqa: B023
            d = d if d > max(figures["least distance"], 1e-4) else 0.0
            assert distance["frame_m"] == pytest.approx(d, abs=1e-6), record["sensor"]
            assert distance["in_time_m"] >= distance["frame_m"] - 1e-9 or record["frames"] == 0


def test_every_figure_has_a_mark_and_a_source_and_assumptions_are_named(capsys):
    for record in json.loads(printed(capsys, "--detect", "hand", "--json")):
        assert all(row["source"] and row["mark"] for row in record["basis"])
        marks = {row["figure"]: row["mark"] for row in record["basis"]}
        assert marks["threshold"] == "assumption"
        assert marks["share of frames at that range"] in ("assumption", "maker's")
        assert marks["between the figures"] == "law"


def test_light_without_a_figure_is_said_and_gives_no_distance(capsys):
    records = json.loads(printed(capsys, "--detect", "hand", "--ambient", "5klx", "--json"))
    assert any(r["distances"] for r in records)
    assert all(bool(r["distances"]) != bool(r["refused"]) for r in records)
    assert "assumption" in printed(capsys, "vl53l5cx", "--detect", "hand", "--ambient", "5klx")


def test_a_sensor_that_is_not_known_or_conditions_alone_are_refused():
    from place_rings.cli.commands.sensors import sensors

    with refused("vl53l5 vl53l5cx"):
        sensors("vl53l5")
    with refused("--ambient 5klx --detect"):
        sensors(ambient="5klx")
