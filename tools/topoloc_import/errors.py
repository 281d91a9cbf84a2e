# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""The one exception that the command line turns into a message."""


class DriveImportError(Exception):
    """Something about the source or the destination is not as it must be."""
