// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>
#include <random>

namespace topoloc::replay {

/// Random choices of one fault. Own arithmetic on the generator's bits: the standard library's
/// distributions differ between implementations.
class FaultChoice {
 public:
  FaultChoice(std::uint64_t seed, std::size_t fault) {
    std::seed_seq mixed{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32U),
                        static_cast<std::uint32_t>(fault)};
    random_.seed(mixed);
  }
  /// True with this probability.
  bool takes(double share) { return static_cast<double>(random_() >> 11U) * 0x1p-53 < share; }
  /// 0 to below `count`.
  std::uint64_t below(std::uint64_t count) { return random_() % count; }

 private:
  std::mt19937_64 random_;
};

}  // namespace topoloc::replay
