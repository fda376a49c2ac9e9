"""The search of placements, and the files it is asked and answered in.

The search is in the files of this folder, and so is the one door for users' files, ``loader``; in the rooms below:

files: what scenes, robots, proposals and results hold, and how these become files
robot: a robot of a URDF, with capsules and mounts fitted to its meshes
mounted: sensors that are mounted already, as rings
improving: the best changes to what is mounted
printing: rings to print
export: setups for other programs
"""
