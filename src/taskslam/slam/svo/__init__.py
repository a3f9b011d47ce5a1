"""Semi-direct visual odometry on stereo images.

Forster, Zhang, Gassner, Werlberger and Scaramuzza, "SVO: Semidirect Visual Odometry for Monocular and Multicamera
Systems", IEEE T-RO 2017.
"""
