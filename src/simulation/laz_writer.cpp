// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/cloud_files.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

#include <laszip/laszip_api.h>

namespace topoloc::simulation {
namespace {

constexpr double kScale_m = 0.001;
constexpr double kGpsEpoch_s = 315964800.0;  // Unix time of the GPS epoch
constexpr double kLeapSeconds = 18.0;        // GPS - UTC since 2017
constexpr double kAdjusted_s = 1e9;          // taken off by LAS's "adjusted standard GPS time"

}  // namespace

struct LazWriter::Handle {
  std::filesystem::path file;
  laszip_POINTER laszip = nullptr;
  laszip_point_struct* point = nullptr;
  bool open = false;

  void check(laszip_I32 result, const char* what) const {
    if (result != 0) {
      laszip_CHAR* text = nullptr;
      laszip_get_error(laszip, &text);
      throw std::runtime_error(file.string() + ": " + what + ": " +
                               (text != nullptr ? text : "unknown reason"));
    }
  }
  ~Handle() {
    if (open) {
      laszip_close_writer(laszip);
    }
    if (laszip != nullptr) {
      laszip_destroy(laszip);
    }
  }
};

LazWriter::LazWriter(const std::filesystem::path& file) : handle_(std::make_unique<Handle>()) {
  handle_->file = file;
  if (laszip_create(&handle_->laszip) != 0) {
    throw std::runtime_error(file.string() + ": LASzip cannot be started");
  }
  laszip_header_struct* header = nullptr;
  handle_->check(laszip_get_header_pointer(handle_->laszip, &header), "no header");
  header->version_major = 1;
  header->version_minor = 4;
  header->header_size = 375;
  header->offset_to_point_data = 375;
  header->point_data_format = 6;
  header->point_data_record_length = 30;
  header->global_encoding = 1U | 16U;  // adjusted standard GPS time; WKT, as format 6 demands
  header->x_scale_factor = header->y_scale_factor = header->z_scale_factor = kScale_m;
  std::strncpy(header->system_identifier, "simulation", sizeof(header->system_identifier) - 1);
  std::strncpy(header->generating_software, "topoloc-simulate",
               sizeof(header->generating_software) - 1);
  handle_->check(laszip_open_writer(handle_->laszip, file.c_str(), 1), "cannot be created");
  handle_->open = true;
  handle_->check(laszip_get_point_pointer(handle_->laszip, &handle_->point), "no point");
}

LazWriter::~LazWriter() = default;

void LazWriter::write(const SurveyPoint& point) {
  laszip_point_struct& out = *handle_->point;
  const auto fixed = [](double value) {
    return static_cast<laszip_I32>(std::lround(value / kScale_m));
  };
  out.X = fixed(point.p_world_m.x());
  out.Y = fixed(point.p_world_m.y());
  out.Z = fixed(point.p_world_m.z());
  out.intensity =
      static_cast<laszip_U16>(std::lround(65535.0F * std::clamp(point.intensity, 0.0F, 1.0F)));
  out.return_number = 1;
  out.number_of_returns = 1;
  out.extended_point_type = 1;
  out.extended_return_number = 1;
  out.extended_number_of_returns = 1;
  out.gps_time =
      static_cast<double>(point.time_ns) * 1e-9 - kGpsEpoch_s + kLeapSeconds - kAdjusted_s;
  handle_->check(laszip_write_point(handle_->laszip), "write error");
  // Counts and bounding box of the header.
  handle_->check(laszip_update_inventory(handle_->laszip), "write error");
}

void LazWriter::close() {
  handle_->open = false;
  handle_->check(laszip_close_writer(handle_->laszip), "write error");
}

}  // namespace topoloc::simulation
