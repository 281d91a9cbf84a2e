// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/maintenance.hpp"
#include "topoloc/map/map_file.hpp"
#include "topoloc/map/node_index.hpp"
#include "topoloc/map/summary.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <sys/mman.h>
#include <unistd.h>
#include <vector>

#include <xxhash.h>

namespace {

/// Gives head and sections right checksums, so that the fuzzer gets to the checks behind them.
void seal(std::vector<std::uint8_t>& map) {
  if (map.size() < 4096) {
    return;
  }
  std::uint32_t count = 0;
  std::memcpy(&count, map.data() + 12, sizeof(count));
  for (std::uint32_t i = 0; i < count && i < 100; ++i) {
    std::uint8_t* const entry = map.data() + 64 + 40 * i;
    std::uint64_t offset = 0;
    std::uint64_t length = 0;
    std::memcpy(&offset, entry + 16, sizeof(offset));
    std::memcpy(&length, entry + 24, sizeof(length));
    if (offset <= map.size() && length <= map.size() - offset) {
      const std::uint64_t extent = std::min((length + 63) / 64 * 64, map.size() - offset);
      const std::uint64_t checksum = XXH3_64bits(map.data() + offset, extent);
      std::memcpy(entry + 32, &checksum, sizeof(checksum));
    }
  }
  std::vector<std::uint8_t> head(map.begin(), map.begin() + 56);
  head.insert(head.end(), map.begin() + 64, map.begin() + 4096);
  const std::uint64_t checksum = XXH3_64bits(head.data(), head.size());
  std::memcpy(map.data() + 56, &checksum, sizeof(checksum));
}

}  // namespace

/// Opens, reads and verifies a map: nothing but MapError may come out.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<std::uint8_t> bytes(data, data + size);
  seal(bytes);
  const int fd = memfd_create("map", 0);
  if (fd < 0 || write(fd, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size())) {
    close(fd);
    return 0;
  }
  const std::filesystem::path path = "/proc/self/fd/" + std::to_string(fd);
  try {
    const topoloc::map::MapFile map(path);
    unsigned sum = 0;
    for (std::size_t i = 0; i < map.node_count(); ++i) {
      const topoloc::map::NodeView node = map.node(i);
      for (const auto& feature : node.features) {
        sum += feature.u;
      }
      for (const std::int8_t value : node.descriptors) {
        sum += static_cast<unsigned>(value);
      }
      for (const auto image : {node.camera_image, node.depth_image, node.intensity_image}) {
        for (const std::byte byte : image) {
          sum += std::to_integer<unsigned>(byte);
        }
      }
    }
    volatile unsigned sink = sum;
    static_cast<void>(sink);
    static_cast<void>(summarise(map));
    std::vector<std::uint32_t> ids(4);
    const topoloc::map::NodeIndex index(map);
    static_cast<void>(index.nearest(map.T_world_cam(0), 4, 25.0, 0.8, ids));
    static_cast<void>(topoloc::map::verify(path));
  } catch (const topoloc::map::MapError&) {
  }
  close(fd);
  return 0;
}
