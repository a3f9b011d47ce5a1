"""Campaigns: from a file that says what is to be compared to runs on a laptop or a cluster, resumed and collected."""
