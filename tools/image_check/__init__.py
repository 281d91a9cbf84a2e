# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""How alike the images of two drives are to a matcher: the parts of tools/image_statistics.py."""
