# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""python -m topoloc_import"""

import sys

from topoloc_import.cli import main

sys.exit(main())
