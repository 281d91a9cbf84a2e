// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/world/random.hpp"

#include <cmath>
#include <numbers>

namespace topoloc::world {
namespace {

constexpr std::uint64_t kStep = 0x9E3779B97F4A7C15U;

// SplitMix64 (Steele, Lea, Flood 2014).
std::uint64_t mixed(std::uint64_t value) {
  value = (value ^ (value >> 30U)) * 0xBF58476D1CE4E5B9U;
  value = (value ^ (value >> 27U)) * 0x94D049BB133111EBU;
  return value ^ (value >> 31U);
}

}  // namespace

std::uint64_t key(std::uint64_t seed, std::initializer_list<std::uint64_t> parts) {
  std::uint64_t result = mixed(seed + kStep);
  for (const std::uint64_t part : parts) {
    result = mixed((result ^ part) + kStep);
  }
  return result;
}

std::uint64_t Random::next() {
  state_ += kStep;
  return mixed(state_);
}

double Random::uniform() { return static_cast<double>(next() >> 11U) * 0x1p-53; }

double Random::uniform(double from, double to) { return from + (to - from) * uniform(); }

// Box and Muller.
double Random::normal() {
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
  return radius * std::cos(2.0 * std::numbers::pi * uniform());
}

int Random::below(int count) { return static_cast<int>(uniform() * count); }

}  // namespace topoloc::world
