// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/point_cloud.hpp"

#include "mapping/lzf.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <span>
#include <sstream>
#include <string>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <laszip/laszip_api.h>

namespace topoloc::mapping {
namespace {

using ::testing::HasSubstr;

class PointCloudFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::temp_directory_path() / ("topoloc_cloud_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& name, const std::string& content) const {
    const auto path = folder_ / name;
    std::ofstream(path, std::ios::binary) << content;
    return path;
  }
  static std::string error_of(const std::filesystem::path& path) {
    try {
      load_point_cloud(path);
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  }

  std::filesystem::path folder_;
};

template <typename T>
std::string raw(T value, bool big_endian = false) {
  std::array<char, sizeof(T)> bytes;
  std::memcpy(bytes.data(), &value, sizeof(T));
  if (big_endian) {
    std::reverse(bytes.begin(), bytes.end());
  }
  return {bytes.data(), bytes.size()};
}

std::string pcd_header(const std::string& points, const std::string& data) {
  return "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z ring intensity\nSIZE 4 4 4 2 4\nTYPE F F F U F\n"
         "COUNT 1 1 1 1 1\nWIDTH " +
         points + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + points + "\nDATA " + data + "\n";
}

void expect_two_points(const PointCloud& cloud) {
  ASSERT_EQ(cloud.size(), 2U);
  EXPECT_TRUE(cloud.has_intensity);
  EXPECT_TRUE(cloud.position_world(0).isApprox(Eigen::Vector3d(1.5, -2.25, 3.0), 1e-9));
  EXPECT_TRUE(cloud.position_world(1).isApprox(Eigen::Vector3d(4.0, 5.0, 6.5), 1e-9));
  EXPECT_EQ(cloud.intensities, (std::vector<float>{0.25F, 7.0F}));
}

std::string two_records() {
  return raw(1.5F) + raw(-2.25F) + raw(3.0F) + raw<std::uint16_t>(9) + raw(0.25F) + raw(4.0F) +
         raw(5.0F) + raw(6.5F) + raw<std::uint16_t>(9) + raw(7.0F);
}

TEST_F(PointCloudFile, ReadsAsciiPcd) {
  expect_two_points(load_point_cloud(
      write("a.pcd", pcd_header("2", "ascii") + "1.5 -2.25 3 9 0.25\n4 5 6.5 9 7\n")));
}

TEST_F(PointCloudFile, ReadsBinaryPcd) {
  expect_two_points(load_point_cloud(write("a.pcd", pcd_header("2", "binary") + two_records())));
}

TEST_F(PointCloudFile, ReadsCompressedPcd) {
  // Field after field, as one LZF literal run of 32 bytes and one of 4.
  const std::string columns = raw(1.5F) + raw(4.0F) + raw(-2.25F) + raw(5.0F) + raw(3.0F) +
                              raw(6.5F) + raw<std::uint16_t>(9) + raw<std::uint16_t>(9) +
                              raw(0.25F) + raw(7.0F);
  ASSERT_EQ(columns.size(), 36U);
  const std::string lzf = char(31) + columns.substr(0, 32) + char(3) + columns.substr(32);
  const std::string sizes = raw(static_cast<std::uint32_t>(lzf.size())) + raw<std::uint32_t>(36);
  const std::string header = pcd_header("2", "binary_compressed");
  expect_two_points(load_point_cloud(write("a.pcd", header + sizes + lzf)));
  EXPECT_THAT(error_of(write("b.pcd", header + sizes + lzf.substr(0, lzf.size() - 1))),
              HasSubstr("truncated"));
  EXPECT_THAT(error_of(write("c.pcd", pcd_header("3", "binary_compressed") + sizes + lzf)),
              HasSubstr("does not fit POINTS"));
}

TEST_F(PointCloudFile, ReadsCompressedPcdOfManyBlocksAsItReadsBinary) {
  constexpr int kPoints = 100'000;
  std::string records;
  std::array<std::string, 5> fields;
  for (int i = 0; i < kPoints; ++i) {
    const auto f = static_cast<float>(i);
    const std::array<std::string, 5> point{raw(f), raw(-0.5F * f), raw(3.0F),
                                           raw(static_cast<std::uint16_t>(i)), raw(0.25F * f)};
    for (std::size_t k = 0; k < point.size(); ++k) {
      records += point[k];
      fields[k] += point[k];
    }
  }
  std::string columns;
  for (const std::string& field : fields) {
    columns += field;
  }
  std::string lzf;  // literal runs only
  for (std::size_t at = 0; at < columns.size(); at += 32) {
    const std::string run = columns.substr(at, 32);
    lzf += static_cast<char>(run.size() - 1) + run;
  }
  const std::string points = std::to_string(kPoints);
  const PointCloud binary =
      load_point_cloud(write("a.pcd", pcd_header(points, "binary") + records));
  const PointCloud compressed =
      load_point_cloud(write("b.pcd", pcd_header(points, "binary_compressed") +
                                          raw(static_cast<std::uint32_t>(lzf.size())) +
                                          raw(static_cast<std::uint32_t>(columns.size())) + lzf));
  EXPECT_TRUE(compressed.positions_m == binary.positions_m);
  EXPECT_TRUE(compressed.intensities == binary.intensities);
  EXPECT_EQ(compressed.size(), static_cast<std::size_t>(kPoints));
}

/// Decompresses in pieces of `piece` bytes; false if the block does not give exactly out.size().
bool lzf_decompress(const std::string& in, std::string& out, std::size_t piece) {
  std::istringstream stream(in);
  LzfReader reader(stream, in.size());
  const auto bytes = std::as_writable_bytes(std::span(out));
  for (std::size_t at = 0; at < out.size(); at += piece) {
    if (!reader.read(bytes.subspan(at, std::min(piece, out.size() - at)))) {
      return false;
    }
  }
  return reader.at_end();
}

TEST(Lzf, ExpandsOverlappingBackReferencesInPiecesOfAnySize) {
  // "abc", then 9 bytes from 3 back (length code 7, plus one more length byte).
  const std::string in{"\2abc\xE0\0\2", 7};
  for (const std::size_t piece : {1U, 5U, 12U}) {
    std::string out(12, '?');
    ASSERT_TRUE(lzf_decompress(in, out, piece));
    EXPECT_EQ(out, "abcabcabcabc");
  }
}

TEST(Lzf, ReachesTheFarthestBackReference) {
  // 8192 literal bytes in 256 runs of 32, then 3 bytes from 8192 back.
  std::string in;
  std::string expected;
  for (int i = 0; i < 256; ++i) {
    const std::string run = std::string(31, static_cast<char>(i)) + "!";
    in += char(31) + run;
    expected += run;
  }
  expected[0] = 'x';
  in[1] = 'x';
  in += std::string{"\x3F\xFF", 2};
  expected += expected.substr(0, 3);
  std::string out(8195, '?');
  ASSERT_TRUE(lzf_decompress(in, out, 1000));
  EXPECT_TRUE(out == expected);
}

TEST(Lzf, RefusesWhatLeavesTheBuffers) {
  const auto refused = [](const std::string& in) {
    std::string out(8, '?');
    return !lzf_decompress(in, out, 8);
  };
  EXPECT_TRUE(refused(std::string{"\x20\0\0", 3}));       // back reference before the start
  EXPECT_TRUE(refused("\5a"));                            // literals cut short
  EXPECT_TRUE(refused(std::string{"\0a\xE0\xC8\0", 5}));  // more than the output takes
  EXPECT_TRUE(refused(std::string{"\0a", 2}));            // less than the output takes
  EXPECT_TRUE(refused(""));
}

TEST_F(PointCloudFile, ReadsAsciiPlyWithOtherElementsAround) {
  expect_two_points(load_point_cloud(write(
      "a.ply",
      "ply\nformat ascii 1.0\ncomment by hand\nelement camera 1\nproperty list uchar int ids\n"
      "element vertex 2\nproperty double x\nproperty double y\nproperty double z\n"
      "property uchar red\nproperty float scalar_Intensity\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n2 7 8\n1.5 -2.25 3 0 0.25\n"
      "4 5 6.5 255 7\n3 0 1 1\n")));
}

TEST_F(PointCloudFile, ReadsBinaryPlyOfBothByteOrders) {
  for (const bool big : {false, true}) {
    const std::string header =
        std::string("ply\nformat ") + (big ? "binary_big_endian" : "binary_little_endian") +
        " 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty double z\n"
        "property uchar class\nproperty float reflectance\nend_header\n";
    const std::string body = raw(1.5F, big) + raw(-2.25F, big) + raw(3.0, big) + "c" +
                             raw(0.25F, big) + raw(4.0F, big) + raw(5.0F, big) + raw(6.5, big) +
                             "c" + raw(7.0F, big);
    expect_two_points(load_point_cloud(write("a.ply", header + body)));
    EXPECT_THAT(error_of(write("b.ply", header + body.substr(0, body.size() - 1))),
                HasSubstr("announces 2 points but holds 1"));
  }
}

const std::string kPlyXyz = "property double x\nproperty double y\nproperty double z\nend_header\n";

TEST_F(PointCloudFile, SaysWhenThereIsNoIntensity) {
  const PointCloud cloud = load_point_cloud(
      write("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\n" + kPlyXyz + "1 2 3\n"));
  EXPECT_FALSE(cloud.has_intensity);
  EXPECT_EQ(cloud.intensities, std::vector<float>{0.0F});
}

TEST_F(PointCloudFile, CountsPointsThatAreNotFinite) {
  const PointCloud cloud = load_point_cloud(write(
      "a.pcd", pcd_header("4", "ascii") + "nan 1 1 0 1\n1 2 3 0 1\n4 -inf 6 0 1\n1e999 0 0 0 1\n"));
  EXPECT_EQ(cloud.size(), 1U);
  EXPECT_EQ(cloud.rejected_not_finite, 3U);
  EXPECT_THAT(error_of(write("b.pcd", pcd_header("1", "ascii") + "nan 1 1 0 1\n")),
              HasSubstr("no usable point (1 not finite"));
}

TEST_F(PointCloudFile, CountsStrayPoints) {
  const PointCloud cloud = load_point_cloud(
      write("a.pcd", pcd_header("3", "ascii") + "1 2 3 0 1\n1e30 0 0 0 1\n2 2 3 0 1\n"));
  EXPECT_EQ(cloud.size(), 2U);
  EXPECT_EQ(cloud.rejected_too_far, 1U);
  EXPECT_THAT(
      error_of(write("b.pcd", pcd_header("3", "ascii") + "1e300 2 3 0 1\n1 0 0 0 1\n2 2 3 0 1\n")),
      HasSubstr("more than 100 km from the first"));
}

TEST_F(PointCloudFile, KeepsMillimetresFarFromZero) {
  const PointCloud cloud = load_point_cloud(
      write("a.ply", "ply\nformat ascii 1.0\nelement vertex 2\n" + kPlyXyz +
                         "691234.567 5334567.891 112.345\n691244.568 5334577.892 113.346\n"));
  EXPECT_LT((cloud.position_world(1) - Eigen::Vector3d(691244.568, 5334577.892, 113.346)).norm(),
            1e-5);
}

TEST_F(PointCloudFile, RefusesWhatIsNotAPointCloud) {
  EXPECT_THAT(error_of(folder_ / "missing.pcd"), HasSubstr("no such point cloud file"));
  EXPECT_THAT(error_of(write("a.xyz", "1 2 3")), HasSubstr("unknown point cloud format '.xyz'"));
  EXPECT_THAT(error_of(write("a.pcd", "")), HasSubstr("no DATA line"));
  EXPECT_THAT(error_of(write("a.ply", "plx\n")), HasSubstr("not a PLY file"));
  EXPECT_THAT(error_of(write("a.las", "LAS?")), HasSubstr("not a LAS file"));
  EXPECT_THAT(error_of(write("b.laz", "LASF" + std::string(300, '\xff'))),
              HasSubstr("contradicts the file"));
  EXPECT_THAT(error_of(write("b.pcd", pcd_header("0", "ascii"))), HasSubstr("holds no point"));
  EXPECT_THAT(error_of(write("c.pcd", pcd_header("1", "ascii") + "1 2 x 0 1\n")),
              HasSubstr("line 12: 'x' is not a number"));
  EXPECT_THAT(error_of(write("d.pcd", pcd_header("2", "ascii") + "1 2 3 0 1\n1 2 3      \n")),
              HasSubstr("line 13: has 3 values, expected 5"));
  EXPECT_THAT(error_of(write("e.ply",
                             "ply\nformat ascii 1.0\nelement vertex 1\n"
                             "property float x\nproperty float y\nend_header\n1 2\n")),
              HasSubstr("no x, y and z (fields: x y)"));
}

TEST_F(PointCloudFile, RefusesAbsurdCountsWithoutAllocating) {
  for (const char* data : {"ascii", "binary"}) {
    EXPECT_THAT(error_of(write("a.pcd", pcd_header("99999999999999", data) + "1 2 3 0 1\n")),
                HasSubstr("announces 99999999999999 points"));
  }
}

class LasFile : public PointCloudFile, public ::testing::WithParamInterface<const char*> {
 protected:
  /// Three points, the last one withheld, through LASzip's own writer.
  std::filesystem::path write_las(const std::string& name) const {
    const auto path = folder_ / name;
    laszip_POINTER writer = nullptr;
    laszip_create(&writer);
    laszip_header_struct* header = nullptr;
    laszip_get_header_pointer(writer, &header);
    header->version_major = 1;
    header->version_minor = 2;
    header->header_size = 227;
    header->offset_to_point_data = 227;
    header->point_data_format = 1;
    header->point_data_record_length = 28;
    header->number_of_point_records = 3;
    header->x_scale_factor = header->y_scale_factor = header->z_scale_factor = 0.001;
    header->x_offset = 691000.0;
    const std::string wkt = "PROJCRS[\"by hand\"]";
    laszip_add_vlr(writer, "LASF_Projection", 2112, static_cast<laszip_U16>(wkt.size()), "",
                   reinterpret_cast<const laszip_U8*>(wkt.data()));
    EXPECT_EQ(laszip_open_writer(writer, path.c_str(), name.ends_with("z") ? 1 : 0), 0);
    laszip_point_struct* point = nullptr;
    laszip_get_point_pointer(writer, &point);
    for (int i = 0; i < 3; ++i) {
      point->X = 1000 * i + 1;
      point->Y = -2000 * i;
      point->Z = 3;
      point->intensity = static_cast<laszip_U16>(100 * i);
      point->withheld_flag = i == 2 ? 1 : 0;
      laszip_write_point(writer);
    }
    laszip_close_writer(writer);
    laszip_destroy(writer);
    return path;
  }
};

TEST_P(LasFile, GivesPointsIntensityAndCoordinateSystem) {
  const PointCloud cloud = load_point_cloud(write_las(GetParam()));
  ASSERT_EQ(cloud.size(), 2U);
  EXPECT_EQ(cloud.rejected_noise, 1U);
  EXPECT_LT((cloud.position_world(1) - Eigen::Vector3d(691001.001, -2.0, 0.003)).norm(), 1e-6);
  EXPECT_EQ(cloud.intensities, (std::vector<float>{0.0F, 100.0F}));
  EXPECT_TRUE(cloud.has_intensity);
  EXPECT_EQ(cloud.crs, "PROJCRS[\"by hand\"]");
}

TEST_P(LasFile, RefusesTruncatedFile) {
  const auto path = write_las(GetParam());
  const auto size = std::filesystem::file_size(path);
  for (const std::uintmax_t left : {size - 40, std::uintmax_t{300}, std::uintmax_t{100}}) {
    std::filesystem::resize_file(path, left);
    EXPECT_THAT(error_of(path), HasSubstr(path.string())) << left << " of " << size << " bytes";
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, LasFile, ::testing::Values("a.las", "a.laz"));

}  // namespace
}  // namespace topoloc::mapping
