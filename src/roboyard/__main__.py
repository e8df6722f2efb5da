"""`python -m roboyard` is `roboyard`."""

import sys

from roboyard.cli import main

sys.exit(main())
