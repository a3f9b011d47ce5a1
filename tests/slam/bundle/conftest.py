"""The made-up views of `vision/synthetic.py` and the scene of `stereo_scene.py`."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "vision"))
