"""The virtual lab: a finished simulated run, photographed as cameras in a real building would."""
