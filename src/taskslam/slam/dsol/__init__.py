"""Direct sparse odometry on stereo images, after DSOL and DSO.

Qu, Shivakumar, Miller and Taylor, "DSOL: A Fast Direct Sparse Odometry Scheme", IROS 2022 (arXiv 2203.08182); Engel,
Koltun and Cremers, "Direct Sparse Odometry", IEEE PAMI 2018 (arXiv 1607.02565).
"""
