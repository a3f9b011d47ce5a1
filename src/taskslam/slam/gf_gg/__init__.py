"""Stereo SLAM on ORB features with good feature selection and good graph selection, after GF-GG and ORB-SLAM2.

Zhao and Vela, "Good Feature Matching: Toward Accurate, Robust VO/VSLAM With Low Latency", IEEE T-RO 36(3), 2020 (arXiv
2001.00714); Zhao, Smith and Vela, "Good Graph to Optimize: Cost-Effective, Budget-Aware Bundle Adjustment in Visual
SLAM", 2020 (arXiv 2008.10123); Mur-Artal and Tardos, "ORB-SLAM2", IEEE T-RO 33(5), 2017 (arXiv 1610.06475).
"""
