// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <algorithm>
#include <array>
#include <compare>
#include <cstdint>
#include <span>
#include <string_view>

namespace topoloc::can {

inline constexpr std::size_t kMaxPayloadBytes = 64;  ///< CAN FD; classic CAN has 8
inline constexpr std::uint32_t kMaxStandardId = 0x7FFU;
inline constexpr std::uint32_t kMaxExtendedId = 0x1FFF'FFFFU;
inline constexpr std::size_t kMaxInterfaceNameBytes = 15;  ///< IFNAMSIZ less its zero

enum class FrameKind : std::uint8_t {
  kData,
  kRemote,  ///< a request: has a length, carries no data
  kError,   ///< made by the controller, not by a node; id is the error class
};

/// Standard and extended ids are different messages even where the numbers agree.
struct FrameId {
  std::uint32_t id = 0;  ///< 11 or 29 bits, without flags
  bool extended = false;
  // clang-tidy 14 takes it for a comparison with zero. NOLINTNEXTLINE(modernize-use-nullptr)
  auto operator<=>(const FrameId&) const = default;
};

/// One frame as it was on the bus. Trivially copyable: it passes through ring buffers.
struct Frame {
  std::int64_t time_ns = 0;  ///< Unix time
  std::uint32_t id = 0;      ///< 11 or 29 bits, without flags
  bool extended = false;
  bool fd = false;
  FrameKind kind = FrameKind::kData;
  std::uint8_t fd_flags = 0;  ///< CAN FD: bit 0 BRS, bit 1 ESI
  std::uint8_t length = 0;    ///< bytes of data that are set
  std::array<std::uint8_t, kMaxPayloadBytes> data{};
  std::array<char, kMaxInterfaceNameBytes + 1> interface_name{};  ///< zero-padded

  [[nodiscard]] std::span<const std::uint8_t> payload() const { return {data.data(), length}; }
  [[nodiscard]] std::string_view interface() const { return interface_name.data(); }
  /// Names longer than kMaxInterfaceNameBytes are cut: the kernel allows none.
  void set_interface(std::string_view name) {
    interface_name.fill('\0');
    std::copy_n(name.begin(), std::min(name.size(), kMaxInterfaceNameBytes),
                interface_name.begin());
  }
  bool operator==(const Frame&) const = default;
};

}  // namespace topoloc::can
