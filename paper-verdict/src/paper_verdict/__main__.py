"""``python -m paper_verdict``."""

import sys

from paper_verdict.command import main

sys.exit(main())
