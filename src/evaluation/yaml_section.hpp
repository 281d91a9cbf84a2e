// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace topoloc::evaluation {

/// The text of a YAML file with keys of one top-level section replaced or added, as written in
/// `values`; everything else, comments included, stays. Throws std::runtime_error where the section
/// is not in block style with one line per key.
std::string with_values(const std::string& yaml, const std::string& section_name,
                        const std::vector<std::pair<std::string, std::string>>& values);

}  // namespace topoloc::evaluation
