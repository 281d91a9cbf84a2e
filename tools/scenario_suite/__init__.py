# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Simulated scenarios from the drive to the report: what tools/suite.py and tools/demo.py share."""
