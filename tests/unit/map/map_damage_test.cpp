// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/maintenance.hpp"
#include "topoloc/map/map_file.hpp"

#include "map_fixture.hpp"

#include <cstdint>
#include <fcntl.h>
#include <functional>
#include <limits>
#include <string>

#include <gmock/gmock.h>

namespace topoloc::map::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class MapDamage : public MapTest {
 protected:
  MapDamage() { write_map(path(), 3, 4); }

  /// Opens the map after a change; all checksums are right again unless `seal` is false.
  void open_with(const std::function<void(MapBytes&)>& change, bool seal = true) {
    MapBytes bytes(path());
    change(bytes);
    if (seal) {
      bytes.seal();
    }
    bytes.write(path("damaged.tmap"));
    const MapFile map(path("damaged.tmap"));
  }
};

#define EXPECT_REFUSED(change, message)                          \
  EXPECT_THAT([&] { open_with([](MapBytes& map) { change; }); }, \
              ThrowsMessage<MapError>(AllOf(HasSubstr("damaged.tmap"), HasSubstr(message))))

TEST_F(MapDamage, TheUnchangedMapIsGood) {
  EXPECT_NO_THROW(open_with([](MapBytes& /*map*/) {}));
  EXPECT_TRUE(verify(path("damaged.tmap")).ok());
}

TEST_F(MapDamage, EveryFlippedBitIsFound) {
  const std::size_t size = std::filesystem::file_size(path());
  const int fd = open(path().c_str(), O_RDWR);
  ASSERT_GE(fd, 0);
  for (std::size_t i = 0; i < size; ++i) {
    char good = 0;
    ASSERT_EQ(pread(fd, &good, 1, static_cast<off_t>(i)), 1);
    const char bad = static_cast<char>(good ^ (1 << (i % 8)));
    ASSERT_EQ(pwrite(fd, &bad, 1, static_cast<off_t>(i)), 1);
    EXPECT_FALSE(verify(path()).ok()) << "byte " << i << " of " << size;
    ASSERT_EQ(pwrite(fd, &good, 1, static_cast<off_t>(i)), 1);
  }
  close(fd);
  EXPECT_TRUE(verify(path()).ok());
}

TEST_F(MapDamage, EveryTruncationIsFoundOnOpening) {
  const std::string whole = MapBytes(path()).bytes();
  for (std::size_t size = 0; size < whole.size(); size += size < 200 ? 1 : 61) {
    MapBytes bytes(path());
    bytes.bytes().resize(size);
    bytes.write(path("damaged.tmap"));
    EXPECT_THROW(MapFile(path("damaged.tmap")), MapError) << size;
  }
  EXPECT_THAT([&] { open_with([](MapBytes& m) { m.bytes().resize(5000); }, false); },
              ThrowsMessage<MapError>(HasSubstr("truncated")));
}

TEST_F(MapDamage, SurplusBytesAreFound) {
  EXPECT_THAT([&] { open_with([](MapBytes& m) { m.bytes() += std::string(64, '\0'); }, false); },
              ThrowsMessage<MapError>(HasSubstr("its header says")));
  EXPECT_REFUSED(map.bytes() += std::string(64, '\0');
                 map.set<std::uint64_t>(16, map.bytes().size()), "sections end at byte");
}

TEST_F(MapDamage, RefusesWhatIsNotAMap) {
  EXPECT_REFUSED(map.set<char>(1, 'X'), "not a topoloc map");
  EXPECT_THROW(MapFile(path("missing.tmap")), MapError);
  EXPECT_THROW(MapFile(path("missing.tmap").parent_path()), MapError);
  EXPECT_REFUSED(map.bytes().clear(); map.bytes().resize(10000), "not a topoloc map");
}

TEST_F(MapDamage, RefusesANewerFormat) {
  EXPECT_REFUSED(map.set<std::uint32_t>(8, 2),
                 "map format version 2, this program reads version 1");
}

TEST_F(MapDamage, RefusesUnknownRequiredSections) {
  EXPECT_REFUSED(map.add_section("LANE", 1), "section LANE version 1 is required");
  EXPECT_REFUSED(map.set<std::uint32_t>(map.entry("NODE") + 4, 2),
                 "section NODE version 2 is required");
}

TEST_F(MapDamage, IgnoresUnknownOptionalSections) {
  EXPECT_NO_THROW(open_with([](MapBytes& map) { map.add_section("LANE", 0); }));
  EXPECT_TRUE(verify(path("damaged.tmap")).ok());
  strip(path("damaged.tmap"), path("stripped.tmap"));
  EXPECT_EQ(MapFile(path("stripped.tmap")).sections().back().name, "LANE");
}

TEST_F(MapDamage, RefusesBrokenSectionTables) {
  EXPECT_REFUSED(map.set<std::uint32_t>(12, 2), "sections end at byte");
  EXPECT_REFUSED(map.set<std::uint32_t>(12, 0), "sections end at byte");
  EXPECT_REFUSED(map.set<std::uint32_t>(12, 0xffffffff), "4294967295 sections, at most 100");
  EXPECT_REFUSED(map.set<std::uint64_t>(map.entry("NODE") + 16, map.offset("INFO")),
                 "section NODE begins at byte");
  EXPECT_REFUSED(map.set<std::uint64_t>(map.entry("NODE") + 16, map.offset("NODE") + 1),
                 "section NODE begins at byte");
  EXPECT_REFUSED(map.set<std::uint64_t>(map.entry("NODE") + 24, 1ULL << 40), "does not fit");
  EXPECT_REFUSED(map.set<std::uint64_t>(map.entry("NODE") + 24, ~0ULL), "does not fit");
  EXPECT_REFUSED(map.set<std::uint64_t>(map.entry("NODE") + 24, ~0ULL - 63), "does not fit");
  EXPECT_REFUSED(map.bytes().replace(map.entry("NODE"), 4, "INFO"), "section INFO appears twice");
  EXPECT_REFUSED(map.bytes().replace(map.entry("NODE"), 4, "N\x1bZ!"), "not printable");
  EXPECT_REFUSED(map.bytes().replace(map.entry("NODE"), 4, "ABCD");
                 map.set<std::uint32_t>(map.entry("ABCD") + 8, 0), "section NODE is missing");
  EXPECT_REFUSED(map.bytes().replace(map.entry("IDIR"), 4, "ABCD"), "section IDIR is missing");
}

TEST_F(MapDamage, RefusesBadInfo) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  EXPECT_REFUSED(map.set<std::int32_t>(map.offset("INFO"), -64), "camera of -64 x 48 px");
  EXPECT_REFUSED(map.set<std::int32_t>(map.offset("INFO"), 1 << 30), "camera of 1073741824");
  EXPECT_REFUSED(map.set<double>(map.offset("INFO") + 8, kNaN), "camera intrinsics");
  EXPECT_REFUSED(map.set<double>(map.offset("INFO") + 40, kNaN), "T_imu_cam");
  EXPECT_REFUSED(map.set<double>(map.offset("INFO") + 64, 2.0), "T_imu_cam");
  EXPECT_REFUSED(map.set<double>(map.offset("INFO") + 96, kNaN), "origin");
  EXPECT_REFUSED(map.set<std::uint32_t>(map.offset("INFO") + 128, 0xffffffff), "dimensions");
  EXPECT_REFUSED(map.set<std::uint32_t>(map.offset("INFO") + 128, 0), "dimensions");
  EXPECT_REFUSED(map.set<std::uint32_t>(map.offset("INFO") + 132, 0xffffffff),
                 "strings do not fill it");
  EXPECT_REFUSED(map.set<std::uint64_t>(map.entry("INFO") + 24, 143), "section");
}

TEST_F(MapDamage, RefusesBadNodes) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr std::size_t kNode1 = 192;  // offset of the second node's record
  EXPECT_REFUSED(map.set<std::int64_t>(map.offset("NODE") + kNode1, 0),
                 "node 1: time is not after");
  EXPECT_REFUSED(map.set<double>(map.offset("NODE") + kNode1 + 8, kNaN), "node 1: position");
  EXPECT_REFUSED(map.set<double>(map.offset("NODE") + kNode1 + 16, 1e300), "node 1: position");
  EXPECT_REFUSED(map.set<double>(map.offset("NODE") + kNode1 + 32, kNaN), "node 1: rotation");
  EXPECT_REFUSED(map.set<double>(map.offset("NODE") + kNode1 + 40, 3.0), "node 1: rotation");
  EXPECT_REFUSED(map.set<float>(map.offset("NODE") + kNode1 + 64, INFINITY), "node 1: covariance");
  EXPECT_REFUSED(map.set<std::uint32_t>(map.offset("NODE") + kNode1 + 148, 0xffffffff),
                 "more than 16384 features");
  EXPECT_REFUSED(map.set<std::uint32_t>(map.offset("NODE") + kNode1 + 148, 100),
                 "node 2: features begin at byte");
  EXPECT_REFUSED(map.set<std::uint64_t>(map.offset("NODE") + kNode1 + 152, 0),
                 "node 1: features begin at byte");
  EXPECT_REFUSED(map.set<std::uint64_t>(map.offset("NODE") + kNode1 + 152, ~0ULL - 63),
                 "node 1: features begin at byte");
  EXPECT_REFUSED(map.set<std::uint32_t>(map.offset("NODE") + 2 * kNode1 + 148, 16384),
                 "its nodes' features take");
  EXPECT_REFUSED(map.set<std::uint32_t>(map.offset("NODE") + kNode1 + 168, 1000), "more lifted");
  EXPECT_REFUSED(map.set<float>(map.offset("NODE") + kNode1 + 172, NAN), "mean depth deviation");
}

TEST_F(MapDamage, RefusesBadImageEntries) {
  EXPECT_REFUSED(map.set<std::uint64_t>(map.offset("IDIR") + 16, ~0ULL), "images of node 1");
  EXPECT_REFUSED(map.set<std::uint32_t>(map.offset("IDIR") + 32 + 8, 0xffffffff),
                 "its nodes' images take");
  EXPECT_REFUSED(map.set<std::uint64_t>(map.offset("LDIR") + 16, ~0ULL),
                 "section LDIR: images of node 1");
  EXPECT_REFUSED(map.set<std::uint32_t>(map.offset("LDIR") + 32 + 8, 0xffffffff),
                 "section LIMG of");
  EXPECT_REFUSED(map.bytes().replace(map.entry("LIMG"), 4, "ABCD"), "section LIMG is missing");
}

TEST_F(MapDamage, VerifyNamesSectionAndByte) {
  MapBytes bytes(path());
  const std::size_t node1 = bytes.get<std::uint64_t>(bytes.offset("NODE") + 192 + 152);
  const std::size_t at = bytes.offset("FEAT") + node1;
  bytes.set<float>(at + 12 + 4, std::numeric_limits<float>::infinity()).write(path());
  const VerifyReport report = verify(path());
  ASSERT_EQ(report.problems.size(), 3U);
  EXPECT_EQ(report.problems[0].section, "FEAT");
  EXPECT_EQ(report.problems[0].offset, bytes.offset("FEAT"));
  EXPECT_THAT(report.problems[1].what, HasSubstr("node 1: wrong checksum"));
  EXPECT_EQ(report.problems[1].offset, at);
  EXPECT_THAT(report.problems[2].what, HasSubstr("node 1: feature 1: depth of inf m"));
  EXPECT_EQ(report.problems[2].offset, at + 12);
}

TEST_F(MapDamage, DamagedNodesAreNotIntact) {
  MapBytes bytes(path());
  bytes.set<char>(bytes.offset("FEAT") + 1, '\x7f').write(path());
  const MapFile map(path());
  EXPECT_FALSE(map.node_intact(0));
  EXPECT_TRUE(map.node_intact(1));
}

TEST_F(MapDamage, NoNodeIsIntactOnceTheFileIsCutShortWhileInUse) {
  const MapFile map(path());
  ASSERT_TRUE(map.node_intact(0));
  std::filesystem::resize_file(path(), 0);
  EXPECT_FALSE(map.node_intact(0));  // and no SIGBUS
  map.prefetch(0);
}

TEST_F(MapDamage, AFileThatIsReplacedStaysAsItWasOpened) {
  MapBytes bytes(path());
  const MapFile map(path());
  bytes.set<char>(bytes.offset("FEAT") + 1, '\x7f').write(path("other.tmap"));
  std::filesystem::rename(path("other.tmap"), path());
  EXPECT_TRUE(map.node_intact(0));
}

TEST_F(MapDamage, VerifyFindsDamagedDepthImagesBehindRightChecksums) {
  MapBytes bytes(path());
  const auto camera_length = bytes.get<std::uint32_t>(bytes.offset("IDIR") + 8);
  bytes.set<char>(bytes.offset("IMAG") + camera_length + 20, '\x7f').seal().write(path());
  const VerifyReport report = verify(path());
  ASSERT_EQ(report.problems.size(), 1U);
  EXPECT_EQ(report.problems[0].section, "IMAG");
  EXPECT_THAT(report.problems[0].what, HasSubstr("depth image"));
}

TEST_F(MapDamage, VerifyFindsDamagedIntensityImagesBehindRightChecksums) {
  MapBytes bytes(path());
  bytes.set<char>(bytes.offset("LIMG") + 20, '\x7f').seal().write(path());
  const VerifyReport report = verify(path());
  ASSERT_EQ(report.problems.size(), 1U);
  EXPECT_EQ(report.problems[0].section, "LIMG");
  EXPECT_EQ(report.problems[0].offset, bytes.offset("LIMG"));
  EXPECT_THAT(report.problems[0].what, HasSubstr("node 0: intensity image"));
}

TEST_F(MapDamage, VerifyFindsAReportThatIsNotJsonBehindRightChecksums) {
  MapBytes bytes(path());
  bytes.set<char>(bytes.offset("REPT"), '}').seal().write(path());
  const VerifyReport report = verify(path());
  ASSERT_EQ(report.problems.size(), 1U);
  EXPECT_EQ(report.problems[0].section, "REPT");
  EXPECT_THAT(report.problems[0].what, HasSubstr("not JSON"));
}

TEST_F(MapDamage, ADamagedReportIsNotGivenAndDoesNotStopTheRest) {
  MapBytes bytes(path());
  bytes.set<char>(bytes.offset("REPT") + 3, 'x').write(path());
  const MapFile map(path());
  EXPECT_EQ(map.node_count(), 3U);
  EXPECT_THAT([&] { (void)map.report(); },
              ThrowsMessage<MapError>(AllOf(HasSubstr("section REPT"), HasSubstr("is damaged"))));
}

TEST_F(MapDamage, StripRefusesADamagedMapAndLeavesTheOldFile) {
  write_map(path("out.tmap"), 1, 2);
  const std::string before = MapBytes(path("out.tmap")).bytes();
  MapBytes bytes(path());
  bytes.set<char>(bytes.offset("FEAT") + 1, '\x7f').write(path());
  EXPECT_THROW(strip(path(), path("out.tmap")), MapError);
  EXPECT_EQ(MapBytes(path("out.tmap")).bytes(), before);
  EXPECT_EQ(files().size(), 2U);
}

}  // namespace
}  // namespace topoloc::map::test
