"""Run a PyBullet script: `python -m roboyard.pybullet SCRIPT [ARGS]`, like `roboyard run SCRIPT [ARGS]`."""

import sys

from roboyard.pybullet.running import main

sys.exit(main(sys.argv[1:]))
