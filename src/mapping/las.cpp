// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mapping/cloud_reader.hpp"

#include <array>
#include <cstring>
#include <fstream>
#include <memory>
#include <span>
#include <string_view>

#include <laszip/laszip_api.h>

// LAS and LAZ (ASPRS LAS 1.0 to 1.4) through LASzip's C interface.
namespace topoloc::mapping {
namespace {

constexpr unsigned kClassLowNoise = 7;
constexpr unsigned kClassHighNoise = 18;
constexpr std::uint16_t kRecordGeoKeys = 34735;
constexpr std::uint16_t kRecordWkt = 2112;
constexpr std::uint16_t kGeoKeyProjectedCrs = 3072;

/// Owns LASzip's reader.
class Reader {
 public:
  explicit Reader(const std::filesystem::path& path) : path_(path) {
    if (laszip_create(&handle_) != 0) {
      fail(path, "LASzip cannot be started");
    }
    laszip_BOOL compressed = 0;
    if (laszip_open_reader(handle_, path.c_str(), &compressed) != 0) {
      const std::string reason = error();
      laszip_destroy(handle_);
      fail(path, "cannot be opened: " + reason);
    }
    if (laszip_get_header_pointer(handle_, &header_) != 0 ||
        laszip_get_point_pointer(handle_, &point_) != 0) {
      laszip_destroy(handle_);
      fail(path, "has no readable header");
    }
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  ~Reader() {
    laszip_close_reader(handle_);
    laszip_destroy(handle_);
  }

  [[nodiscard]] const laszip_header_struct& header() const { return *header_; }
  [[nodiscard]] std::uint64_t point_count() const {
    return header_->number_of_point_records != 0 ? header_->number_of_point_records
                                                 : header_->extended_number_of_point_records;
  }
  const laszip_point_struct& next(std::uint64_t i) {
    if (laszip_read_point(handle_) != 0) {
      fail(path_, "cannot be read past point " + std::to_string(i) + " of " +
                      std::to_string(point_count()) + " (truncated?): " + error());
    }
    return *point_;
  }

 private:
  [[nodiscard]] std::string error() const {
    laszip_CHAR* text = nullptr;
    laszip_get_error(handle_, &text);
    return text != nullptr ? text : "unknown reason";
  }

  std::filesystem::path path_;
  laszip_POINTER handle_ = nullptr;
  laszip_header_struct* header_ = nullptr;
  laszip_point_struct* point_ = nullptr;
};

/// Checks by hand what LASzip would trust: it allocates what the header announces.
void check_prefix(const std::filesystem::path& path, std::uint64_t file_size) {
  constexpr std::size_t kSmallestHeader = 227;
  std::array<char, kSmallestHeader> head{};
  std::ifstream stream(path, std::ios::binary);
  if (!stream.read(head.data(), head.size()) || std::string_view(head.data(), 4) != "LASF") {
    fail(path, "not a LAS file: does not begin with 'LASF' and a header");
  }
  std::uint16_t header_size = 0;
  std::uint32_t points_at = 0;
  std::uint32_t vlr_count = 0;
  std::memcpy(&header_size, head.data() + 94, sizeof(header_size));
  std::memcpy(&points_at, head.data() + 96, sizeof(points_at));
  std::memcpy(&vlr_count, head.data() + 100, sizeof(vlr_count));
  constexpr std::uint64_t kVlrHeaderSize = 54;
  if (header_size < kSmallestHeader || points_at < header_size || points_at > file_size ||
      vlr_count * kVlrHeaderSize > points_at - header_size) {
    fail(path, "LAS header contradicts the file: points at byte " + std::to_string(points_at) +
                   ", " + std::to_string(vlr_count) + " records before them, file of " +
                   std::to_string(file_size) + " bytes");
  }
}

/// OGC WKT if the file has it, else the EPSG code of its GeoTIFF keys, else nothing.
std::string coordinate_reference_system(const laszip_header_struct& header) {
  std::string epsg;
  const std::span vlrs(header.vlrs, header.number_of_variable_length_records);
  for (const laszip_vlr_struct& vlr : vlrs) {
    if (std::string_view(vlr.user_id, strnlen(vlr.user_id, 16)) != "LASF_Projection") {
      continue;
    }
    const std::size_t length = vlr.record_length_after_header;
    if (vlr.record_id == kRecordWkt) {
      const auto* text = reinterpret_cast<const char*>(vlr.data);
      return {text, strnlen(text, length)};
    }
    if (vlr.record_id == kRecordGeoKeys) {
      // uint16 quadruples (key, where, count, value); where = 0: the value itself.
      for (std::size_t at = 8; at + 8 <= length; at += 8) {
        std::array<std::uint16_t, 4> key{};
        std::memcpy(key.data(), vlr.data + at, sizeof(key));
        if (key[0] == kGeoKeyProjectedCrs && key[1] == 0) {
          epsg = "EPSG:" + std::to_string(key[3]);
        }
      }
    }
  }
  return epsg;
}

bool is_noise(const laszip_point_struct& point) {
  const unsigned classification =
      point.extended_point_type != 0 ? point.extended_classification : point.classification;
  return point.withheld_flag != 0 || classification == kClassLowNoise ||
         classification == kClassHighNoise;
}

}  // namespace

void read_las(const std::filesystem::path& path, PointSink& sink, const Progress& progress) {
  const std::uint64_t file_size = std::filesystem::file_size(path);
  check_prefix(path, file_size);
  Reader reader(path);
  const laszip_header_struct& header = reader.header();
  const std::uint64_t count = reader.point_count();
  if (count == 0) {
    fail(path, "holds no point");
  }
  // LAZ reaches about a tenth on real data. A count beyond 8 points a byte cannot be true.
  if (count / 8 > file_size) {
    fail(path, "announces " + std::to_string(count) + " points in a file of " +
                   std::to_string(file_size) + " bytes");
  }
  sink.expect(count);
  const ProgressTicker ticker(progress, count);
  for (std::uint64_t i = 0; i < count; ++i) {
    const laszip_point_struct& point = reader.next(i);
    ticker.at(i);
    if (is_noise(point)) {
      ++sink.info().rejected_noise;
      continue;
    }
    sink.add({header.x_scale_factor * point.X + header.x_offset,
              header.y_scale_factor * point.Y + header.y_offset,
              header.z_scale_factor * point.Z + header.z_offset},
             static_cast<float>(point.intensity));
    // LAS always has the field; a scanner without intensity leaves it 0.
    sink.info().has_intensity |= point.intensity != 0;
  }
  sink.info().crs = coordinate_reference_system(header);
}

}  // namespace topoloc::mapping
