// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <stdexcept>

namespace topoloc::config {

/// Something is wrong in a configuration file. what() reads
/// "vehicle.yaml:12: speed.std_forward_mps: expected a number in (0, 10], found 'abc'".
class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace topoloc::config
