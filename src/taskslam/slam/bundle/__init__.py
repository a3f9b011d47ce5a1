"""Bundle adjustment over inverse depths: photometric residuals of a stereo window, and the Schur complement."""
