"""Voxels under a weight field: those of a weight above 0, and sets of them with integer weights."""

import numpy as np

from ..weight_field import WeightField
from .sample_points import samples_of
from .voxel_set import VoxelSet, centre, decode, ranges, runs_of

_DISTINCT = 16  # weights up to which each has a set of voxels of its own; above, each bit has one
_CHUNK = 1 << 20  # voxels processed at once


def important(field: WeightField, voxels: VoxelSet, sampled: bool) -> VoxelSet:
    """Return the voxels of a set with a weight above 0 at their sample points or centres."""
    if field.outside and (field.level > 0).all():
        return voxels
    runs = [
        runs_of(key[field.levels_at(_points(key, voxels.voxel, sampled)) > 0])
        for key in _keys(voxels)
    ]
    if not runs:
        return voxels
    start, length = (np.concatenate(ends) for ends in zip(*runs, strict=True))
    return VoxelSet.of_cells(voxels.voxel, start, length)


def layers(field: WeightField, wanted: VoxelSet, sampled: bool) -> list[tuple[int, VoxelSet]]:
    """Return sets of the voxels of ``wanted``, each with an integer weight.

    The weight of a voxel is that at its sample point or centre, and the sum of the weights of all
    sets that contain it: a set for each weight where these are few, else for each of their binary
    digits.
    """
    values = np.unique(np.append(field.level, field.outside))
    few = len(values) <= _DISTINCT
    weights = [int(v) for v in values if v] if few else [1 << bit for bit in range(16)]
    runs: list[list[tuple[np.ndarray, np.ndarray]]] = [[] for _ in weights]
    for key in _keys(wanted):
        level = field.levels_at(_points(key, wanted.voxel, sampled))
        for weight, of_weight in zip(weights, runs, strict=True):
            of_weight.append(runs_of(key[level == weight if few else (level & weight) > 0]))
    sets = []
    for weight, of_weight in zip(weights, runs, strict=True):
        if not of_weight:
            continue
        start, length = (np.concatenate(ends) for ends in zip(*of_weight, strict=True))
        sets.append((weight, VoxelSet.of_cells(wanted.voxel, start, length)))
    return [(weight, layer) for weight, layer in sets if len(layer)]


def _points(key: np.ndarray, voxel: float, sampled: bool) -> np.ndarray:
    return samples_of(key, voxel) if sampled else centre(decode(key), 0, voxel)


def _keys(wanted: VoxelSet) -> list[np.ndarray]:
    """Return the keys of a set's voxels, ascending, in parts of bounded size."""
    length = wanted.stop - wanted.start
    group = np.cumsum(length) // _CHUNK
    return [
        ranges(wanted.start[group == number], wanted.stop[group == number])
        for number in np.unique(group)
    ]
