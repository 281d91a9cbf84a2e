// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstddef>
#include <span>

namespace topoloc::mapping {

/// Decompresses an LZF block (the compression of PCD's binary_compressed). False if it is corrupt
/// or does not fill `out` exactly.
bool lzf_decompress(std::span<const std::byte> in, std::span<std::byte> out);

}  // namespace topoloc::mapping
