"""`python -m mpmworlds` is the command `mpmworlds`."""

import sys

from mpmworlds.cli import main

sys.exit(main())
