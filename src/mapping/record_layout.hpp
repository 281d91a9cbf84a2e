// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// Records of named scalar fields, as PCD and PLY describe their points.
namespace topoloc::mapping {

static_assert(std::endian::native == std::endian::little, "files are decoded in place");

enum class Scalar {
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat32,
  kFloat64
};

constexpr std::size_t size_of(Scalar type) {
  constexpr std::array<std::size_t, 10> kSizes{1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

template <typename T>
double load_scalar(const std::byte* at, bool swap_bytes) {
  std::array<std::byte, sizeof(T)> raw;
  std::memcpy(raw.data(), at, sizeof(T));
  if (swap_bytes) {
    std::reverse(raw.begin(), raw.end());
  }
  return static_cast<double>(std::bit_cast<T>(raw));
}

inline double load_scalar(Scalar type, const std::byte* at, bool swap_bytes = false) {
  switch (type) {
    case Scalar::kInt8:
      return load_scalar<std::int8_t>(at, swap_bytes);
    case Scalar::kUint8:
      return load_scalar<std::uint8_t>(at, swap_bytes);
    case Scalar::kInt16:
      return load_scalar<std::int16_t>(at, swap_bytes);
    case Scalar::kUint16:
      return load_scalar<std::uint16_t>(at, swap_bytes);
    case Scalar::kInt32:
      return load_scalar<std::int32_t>(at, swap_bytes);
    case Scalar::kUint32:
      return load_scalar<std::uint32_t>(at, swap_bytes);
    case Scalar::kInt64:
      return load_scalar<std::int64_t>(at, swap_bytes);
    case Scalar::kUint64:
      return load_scalar<std::uint64_t>(at, swap_bytes);
    case Scalar::kFloat32:
      return load_scalar<float>(at, swap_bytes);
    case Scalar::kFloat64:
      return load_scalar<double>(at, swap_bytes);
  }
  return 0.0;
}

struct Field {
  std::string name;  ///< lower case
  Scalar type = Scalar::kFloat32;
  std::size_t count = 1;   ///< PCD allows several values per field
  std::size_t offset = 0;  ///< bytes from the start of the record
  std::size_t column = 0;  ///< index of the first value in an ascii row
};

/// The fields of one record, in file order.
class RecordLayout {
 public:
  void add(std::string name, Scalar type, std::size_t count = 1) {
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    fields_.push_back({std::move(name), type, count, record_size_, column_count_});
    record_size_ += size_of(type) * count;
    column_count_ += count;
  }
  [[nodiscard]] const std::vector<Field>& fields() const { return fields_; }
  [[nodiscard]] std::size_t record_size() const { return record_size_; }
  [[nodiscard]] std::size_t column_count() const { return column_count_; }
  [[nodiscard]] std::optional<Field> find(std::string_view name) const {
    const auto it = std::find_if(fields_.begin(), fields_.end(),
                                 [&](const Field& field) { return field.name == name; });
    return it == fields_.end() ? std::nullopt : std::optional<Field>(*it);
  }

 private:
  std::vector<Field> fields_;
  std::size_t record_size_ = 0;
  std::size_t column_count_ = 0;
};

/// The fields of a record that a point is made of.
struct PointFields {
  Field x, y, z;
  std::optional<Field> intensity;
};

/// Nothing if x, y or z is missing.
inline std::optional<PointFields> point_fields(const RecordLayout& layout) {
  const auto x = layout.find("x");
  const auto y = layout.find("y");
  const auto z = layout.find("z");
  if (!x || !y || !z) {
    return std::nullopt;
  }
  PointFields fields{*x, *y, *z, std::nullopt};
  for (const char* name : {"intensity", "scalar_intensity", "reflectance"}) {
    if (!fields.intensity) {
      fields.intensity = layout.find(name);
    }
  }
  return fields;
}

}  // namespace topoloc::mapping
