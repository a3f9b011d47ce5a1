"""The made-up views of `synthetic.py`, also for the tests of bundle adjustment."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
