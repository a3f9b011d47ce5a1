"""What direct and semi-direct methods see with: pinholes, pyramids, points worth tracking, disparities, alignment."""
