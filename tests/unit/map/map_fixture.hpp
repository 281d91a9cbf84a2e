// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/so3.hpp"
#include "topoloc/map/depth_codec.hpp"
#include "topoloc/map/intensity_codec.hpp"
#include "topoloc/map/map_writer.hpp"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <unistd.h>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <xxhash.h>

namespace topoloc::map::test {

/// A folder of its own for each test, removed afterwards.
class MapTest : public ::testing::Test {
 protected:
  MapTest() {
    const auto* const test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              ("topoloc_map_" + std::to_string(getpid()) + "_" + test->name());
    std::filesystem::create_directories(folder_);
  }
  ~MapTest() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::filesystem::path path(const std::string& name = "test.tmap") const {
    return folder_ / name;
  }
  [[nodiscard]] std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
      names.push_back(entry.path().filename().string());
    }
    return names;
  }

 private:
  std::filesystem::path folder_;
};

inline MapInfo make_info(int descriptor_dim = 8) {
  MapInfo info;
  info.camera = {64, 48, 45.0, 46.0, 31.5, 23.5};
  info.T_imu_cam = {so3::exp({-1.2, 1.1, -1.3}), {1.1, -0.2, 0.7}};
  info.model = {"xfeat", 0x0123456789abcdefULL, descriptor_dim};
  info.origin_m = {691000.25, 5334000.5, 515.125};
  info.crs = "EPSG:32632";
  info.creator = "unit test";
  return info;
}

/// Node i of a made-up drive; the same for the same arguments.
inline NodeDraft make_node(std::size_t i, std::size_t feature_count, const MapInfo& info,
                           bool images = true) {
  std::mt19937 random(static_cast<unsigned>(i) + 1);
  std::uniform_real_distribution<float> unit(0.0F, 1.0F);
  NodeDraft node;
  node.time_ns = 1'317'000'000'123'456'789 + static_cast<std::int64_t>(i) * 100'000'000;
  node.T_world_cam = {so3::exp({0.1, 0.02 * static_cast<double>(i), -0.3}),
                      {5.0 * static_cast<double>(i), 0.1, -1.0 / 3.0}};
  Eigen::Matrix<double, 6, 6> a;
  for (double& x : a.reshaped()) {
    x = 0.01 * static_cast<double>(unit(random));
  }
  node.covariance = a * a.transpose();
  for (std::size_t k = 0; k < feature_count; ++k) {
    Feature feature;
    feature.pixel_px = {unit(random) * static_cast<float>(info.camera.width_px - 1),
                        unit(random) * static_cast<float>(info.camera.height_px - 1)};
    feature.depth_m = k % 3 == 0 ? 0.0F : 2.0F + 80.0F * unit(random);
    feature.depth_std_m = k % 3 == 0 ? 0.0F : 0.02F + unit(random);
    feature.score = unit(random);
    node.features.push_back(feature);
  }
  for (std::size_t k = 0; k < feature_count * static_cast<std::size_t>(info.model.descriptor_dim);
       ++k) {
    node.descriptors.push_back(static_cast<std::int8_t>(static_cast<int>(random() % 255) - 127));
  }
  if (images) {
    node.camera_image = {std::byte{0xff}, std::byte{0xd8}, std::byte{0xff}, std::byte{0xe0}};
    node.camera_image.resize(20 + i, std::byte{0x55});
    std::vector<float> depth_m(static_cast<std::size_t>(info.camera.width_px) *
                               static_cast<std::size_t>(info.camera.height_px));
    for (std::size_t k = 0; k < depth_m.size(); k += 97) {
      depth_m[k] = 1.0F + static_cast<float>(i);
    }
    node.depth_image = encode_depth(depth_m, info.camera.width_px, info.camera.height_px);
    std::vector<std::uint8_t> intensity(depth_m.size());
    for (std::size_t k = 0; k < intensity.size(); k += 97) {
      intensity[k] = static_cast<std::uint8_t>(1 + (k + i) % 255);
    }
    node.intensity_image = encode_intensity(intensity, info.camera.width_px, info.camera.height_px);
  }
  return node;
}

inline void write_map(const std::filesystem::path& path, std::size_t node_count,
                      std::size_t feature_count, const MapInfo& info = make_info(),
                      bool images = true) {
  MapWriter writer(path, info);
  for (std::size_t i = 0; i < node_count; ++i) {
    writer.add(make_node(i, feature_count + i, info, images));
  }
  writer.set_report(R"({"planned": )" + std::to_string(node_count) + "}");
  writer.finish();
}

/// The bytes of a map, to be changed and sealed again with right checksums: what gets past the
/// checksums must still be refused by the checks behind them. Offsets are those of
/// docs/map-format.md, on purpose not taken from the code.
class MapBytes {
 public:
  explicit MapBytes(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    bytes_.assign(std::istreambuf_iterator<char>(in), {});
  }
  void write(const std::filesystem::path& path) const {
    std::ofstream out(path, std::ios::binary);
    out.write(bytes_.data(), static_cast<std::streamsize>(bytes_.size()));
  }

  template <typename T>
  T get(std::size_t offset) const {
    T value;
    std::memcpy(&value, bytes_.data() + offset, sizeof(T));
    return value;
  }
  template <typename T>
  MapBytes& set(std::size_t offset, T value) {
    std::memcpy(bytes_.data() + offset, &value, sizeof(T));
    return *this;
  }

  /// Byte offset of the table entry of a section.
  [[nodiscard]] std::size_t entry(const std::string& name) const {
    for (std::size_t i = 0; i < get<std::uint32_t>(12); ++i) {
      if (bytes_.compare(64 + 40 * i, 4, name) == 0) {
        return 64 + 40 * i;
      }
    }
    ADD_FAILURE() << "no section " << name;
    return 0;
  }
  [[nodiscard]] std::size_t offset(const std::string& name) const {
    return get<std::uint64_t>(entry(name) + 16);
  }

  /// Appends an empty section.
  MapBytes& add_section(const std::string& name, std::uint32_t flags) {
    const auto count = get<std::uint32_t>(12);
    const std::size_t at = 64 + 40 * count;
    bytes_.replace(at, 4, name);
    set<std::uint32_t>(at + 4, 1).set<std::uint32_t>(at + 8, flags);
    set<std::uint64_t>(at + 16, bytes_.size()).set<std::uint64_t>(at + 24, 0);
    return set<std::uint32_t>(12, count + 1);
  }

  /// Gives every section that lies in the file, and the head, its right checksum.
  MapBytes& seal() {
    for (std::size_t i = 0; i < std::min<std::size_t>(get<std::uint32_t>(12), 100); ++i) {
      const std::size_t at = 64 + 40 * i;
      const auto begin = get<std::uint64_t>(at + 16);
      const auto length = get<std::uint64_t>(at + 24);
      if (begin <= bytes_.size() && length <= bytes_.size() - begin) {
        const std::size_t extent =
            std::min((length + 63) / 64 * 64, static_cast<std::uint64_t>(bytes_.size()) - begin);
        set<std::uint64_t>(at + 32, XXH3_64bits(bytes_.data() + begin, extent));
      }
    }
    return seal_head();
  }
  MapBytes& seal_head() {
    const std::string head = bytes_.substr(0, 56) + bytes_.substr(64, 4096 - 64);
    return set<std::uint64_t>(56, XXH3_64bits(head.data(), head.size()));
  }

  std::string& bytes() { return bytes_; }

 private:
  std::string bytes_;
};

}  // namespace topoloc::map::test
