"""The statement of a certificate: a file whose numbers are not what their names say is refused."""

import json

import numpy as np

FAR = 1e4  # m: of larger numbers, rounding could exceed what the checker allows
RIGHT = 1.57  # rad: half angles are less than right angles


def numbers(values, least=-FAR, most=FAR):
    found = np.array(values, float)
    if not ((found >= least) & (found <= most)).all():  # nor are they NaN
        raise ValueError(f"found numbers that are not from {least:g} to {most:g}")
    return found


def vectors(*arrays):
    """Arrays (N, 3) of one length."""
    found = [np.reshape(a, (len(a), 3)) for a in map(numbers, arrays)]
    if any(len(a) != len(found[0]) for a in found):
        raise ValueError("found vectors that belong to no shape")
    return found


def sizes(values, count, most=FAR):
    found = numbers(values, 0, most)
    if found.shape != (count,):
        raise ValueError(f"found {found.size} sizes of {count} shapes")
    return found


def units(*arrays):
    """Arrays (N, 3) of unit vectors, of each array at right angles to those of the others."""
    found = vectors(*arrays)
    for k, a in enumerate(found):
        for other, b in enumerate(found):
            if (abs((a * b).sum(-1) - (k == other)) > 1e-9).any():
                raise ValueError("found directions that are no unit vectors or at no right angles")
    return found


def _once(pairs):
    if len(dict(pairs)) < len(pairs):
        raise ValueError("a key appears twice")
    return dict(pairs)


def stated(text):
    """Coverage of targets, and items: each is one target at one pose, with the pose's weight."""
    said = json.loads(text, object_pairs_hook=_once)
    if said["certificate"] != 1:
        raise ValueError("a certificate of another version")
    poses = [(item["name"], item["pose"]) for item in said["items"]]
    if not poses or len(set(poses)) < len(poses):
        raise ValueError("no target, or a pose of a target twice")
    if set(said["coverage"]) != {target for target, _ in poses}:
        raise ValueError("coverage and shapes are of different targets")
    for target in said["coverage"]:
        if not target.isprintable() or "%" in target:
            raise ValueError("a name of a target could be taken for a result")
        weights = [item["weight"] for item in said["items"] if item["name"] == target]
        if abs(sizes(weights, len(weights)).sum() - 1) > 1e-9:
            raise ValueError(f"{target}: the weights of its poses do not add up to 1")
    return said
