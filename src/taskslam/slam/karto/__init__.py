"""The parts of `karto`: scans to points, correlative matching, keyframes, pose graph, loop closure, map file.

Read `mapper.py` first: `Mapper.process` is the method as a list of steps.
"""
