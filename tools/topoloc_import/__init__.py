# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Importers: public recordings to topoloc's drive folders (docs/drive-folder.md)."""
