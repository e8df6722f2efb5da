"""`python -m roboyard.pybullet script.py [args]` is `roboyard run script.py [args]`."""

import sys

from roboyard.cli import main

sys.exit(main(["run", *sys.argv[1:]]))
