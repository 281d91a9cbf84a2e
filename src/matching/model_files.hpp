// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/matching/config.hpp"

#include <filesystem>

namespace topoloc::matching {

/// The files that a configuration names, in matching.model_dir. Throw std::runtime_error that says
/// which command makes a missing one.

/// <extractor>_<width>x<height>_n<max_features>.onnx
std::filesystem::path extractor_file(const MatchingConfig& config);
/// Whether extractor_file() would find it.
bool has_extractor_file(const MatchingConfig& config);

/// The configuration for half of the rows, rounded up to the 32 pixels that networks need, and half
/// of the features.
MatchingConfig band_of(MatchingConfig config);

/// "lighterglue": lighterglue_n<max_features>.onnx. "lightglue": lightglue-<family>_n<...>.onnx,
/// where the family of "aliked-n16" is "aliked", for its variants share a matcher. Throws
/// std::invalid_argument where the matcher was not trained with the extractor.
std::filesystem::path lightglue_file(const MatchingConfig& config);

}  // namespace topoloc::matching
