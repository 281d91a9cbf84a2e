# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Fixed-size ONNX graphs of the learned feature extractor and matcher."""
