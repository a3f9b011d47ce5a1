"""Scan-to-map alignment on multi-resolution occupancy grids: Kohlbrecher et al. 2011.

"A flexible and scalable SLAM system with full 3D motion estimation", IEEE SSRR 2011; the planar part.
"""
