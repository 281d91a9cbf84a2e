// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>
#include <initializer_list>

namespace topoloc::world {

/// One number out of a seed and what tells draws apart (which object, which frame, which pixel):
/// what one thing draws does not depend on what others drew before, nor on threads.
std::uint64_t key(std::uint64_t seed, std::initializer_list<std::uint64_t> parts);

/// Random numbers from a key; the same on every machine and with every standard library, but for
/// the last bits of normal(), which has them from the library's logarithm and cosine.
class Random {
 public:
  explicit Random(std::uint64_t key) : state_(key) {}

  std::uint64_t next();                    ///< 64 random bits
  double uniform();                        ///< [0, 1)
  double uniform(double from, double to);  ///< [from, to)
  double normal();                         ///< mean 0, standard deviation 1
  int below(int count);                    ///< 0 to count - 1
  bool chance(double probability) { return uniform() < probability; }

 private:
  std::uint64_t state_;
};

}  // namespace topoloc::world
