// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/config/vehicle_config.hpp"

#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

namespace topoloc::config {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::string kVehicle = R"(format: 1
name: test
can:
  dbc: bus.dbc
  imu:
    acceleration: [A.X, A.Y, A.Z]
    angular_rate: [R.X, R.Y, R.Z]
camera:
  calibration: camchain.yaml
imu:
  calibration: imu.yaml
)";

const std::string kCamchain = R"(cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  intrinsics: [500.0, 501.0, 320.0, 240.0]
  distortion_model: radtan
  distortion_coeffs: [-0.3, 0.1, 0.001, 0.002]
  resolution: [640, 480]
  rostopic: /cam0/image_raw
  T_cam_imu:
  - [0.0, -1.0, 0.0, 0.1]
  - [0.0, 0.0, -1.0, 0.2]
  - [1.0, 0.0, 0.0, 0.3]
  - [0.0, 0.0, 0.0, 1.0]
  timeshift_cam_imu: -0.0021
)";

const std::string kImu = R"(accelerometer_noise_density: 0.01
accelerometer_random_walk: 0.0002
gyroscope_noise_density: 0.005
gyroscope_random_walk: 4.0e-06
rostopic: /imu0
update_rate: 200.0
)";

class ConfigTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(dir_);
    write("vehicle.yaml", kVehicle);
    write("camchain.yaml", kCamchain);
    write("imu.yaml", kImu);
    write("bus.dbc", "");
  }
  void TearDown() override { std::filesystem::remove_all(dir_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(dir_ / name) << text;
  }
  VehicleConfig load() const { return load_vehicle_config(dir_ / "vehicle.yaml"); }

  /// What load() complains about; fails the test if it does not.
  std::string complaint() const {
    try {
      load();
    } catch (const ConfigError& error) {
      return error.what();
    }
    ADD_FAILURE() << "no ConfigError";
    return "";
  }
  [[nodiscard]] std::string complaint_with(const std::string& more) const {
    write("vehicle.yaml", kVehicle + more);
    return complaint();
  }

  std::filesystem::path dir_ =
      std::filesystem::temp_directory_path() /
      ("topoloc_config_" +
       std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
};

std::string replaced(const std::string& text, const std::string& from, const std::string& to) {
  std::string result = text;
  result.replace(result.find(from), from.size(), to);
  return result;
}

TEST_F(ConfigTest, AbsentKeysKeepTheirDefaults) {
  const VehicleConfig config = load();
  EXPECT_EQ(config.name, "test");
  EXPECT_EQ(config.camera.channel, "CAMERA");
  EXPECT_EQ(config.estimator.health.fix_timeout_s, estimation::HealthConfig{}.fix_timeout_s);
  EXPECT_TRUE(config.estimator.models.speed.R_vehicle_imu.isIdentity());
  EXPECT_EQ(config.matching.focal_px, matching::MatchingConfig{}.focal_px);
}

TEST_F(ConfigTest, ReadsWhatTheFileSays) {
  write("vehicle.yaml", kVehicle + R"(vehicle:
  rotation_vehicle_imu_rpy_rad: [0.0, 0.0, 1.5707963267948966]
  wheel_reference_imu_m: [1.0, 2.0, 3.0]
speed: {use: false, std_lateral_mps: 0.25}
estimator:
  map_update: {kernel: huber}
  history: {capacity: 99}
  map_wander: {share: 0.01}
matching: {matcher: mutual, model_dir: models}
)");
  const VehicleConfig config = load();
  const estimation::SpeedModel& speed = config.estimator.models.speed;
  EXPECT_TRUE((speed.R_vehicle_imu * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY()));
  EXPECT_EQ(speed.wheel_reference_imu_m, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_FALSE(config.estimator.use_speed);
  EXPECT_EQ(speed.std_lateral_mps, 0.25);
  EXPECT_EQ(config.estimator.models.map_update.kernel, estimation::RobustKernel::kHuber);
  EXPECT_EQ(config.estimator.history.capacity, 99);
  EXPECT_EQ(config.estimator.models.map_wander.share, 0.01);
  EXPECT_EQ(config.estimator.models.map_wander.length_m, estimation::MapWander{}.length_m);
  EXPECT_EQ(config.matching.matcher, "mutual");
  EXPECT_EQ(config.matching.model_dir, dir_ / "models");
  EXPECT_THAT(config.can.dbcs, ElementsAre(dir_ / "bus.dbc"));
  EXPECT_EQ(config.can.imu.angular_rate[2], "R.Z");
}

TEST_F(ConfigTest, BusesMayHaveADbcEach) {
  write("imu.dbc", "");
  write("vehicle.yaml", replaced(kVehicle, "bus.dbc", "[bus.dbc, imu.dbc]"));
  EXPECT_THAT(load().can.dbcs, ElementsAre(dir_ / "bus.dbc", dir_ / "imu.dbc"));
  write("vehicle.yaml", replaced(kVehicle, "bus.dbc", "[bus.dbc, none.dbc]"));
  EXPECT_THAT(complaint(), AllOf(HasSubstr("can.dbc: no such file"), HasSubstr("none.dbc")));
  write("vehicle.yaml", replaced(kVehicle, "bus.dbc", "[]"));
  EXPECT_THAT(complaint(), HasSubstr("can.dbc: expected at least one"));
}

TEST_F(ConfigTest, ReadsTurnOnBiases) {
  write("vehicle.yaml", kVehicle +
                            "  gyro_bias_radps: [0.01, -0.02, 0.03]\n"
                            "  accel_bias_mps2: [0.1, 0.2, -0.3]\n"
                            "  gyro_bias_std_radps: 0.0002\n");
  const estimation::EstimatorConfig config = load().estimator;
  EXPECT_EQ(config.initial_gyro_bias_radps, Eigen::Vector3d(0.01, -0.02, 0.03));
  EXPECT_EQ(config.initial_accel_bias_mps2, Eigen::Vector3d(0.1, 0.2, -0.3));
  EXPECT_EQ(config.initial.gyro_bias_radps, 0.0002);
  EXPECT_EQ(config.initial.accel_bias_mps2, estimation::InitialUncertainty{}.accel_bias_mps2);
}

TEST_F(ConfigTest, VehicleMayBeWithoutCamera) {
  EXPECT_TRUE(load().camera.configured());
  write("vehicle.yaml", replaced(kVehicle, "camera:\n  calibration: camchain.yaml\n", ""));
  EXPECT_FALSE(load().camera.configured());
}

TEST_F(ConfigTest, ReadsKalibrFilesAsTheyAre) {
  const VehicleConfig config = load();
  const KalibrCamera& camera = config.camera.kalibr;
  EXPECT_EQ(camera.calibration.pinhole, (PinholeCamera{640, 480, 500.0, 501.0, 320.0, 240.0}));
  EXPECT_EQ(camera.calibration.distortion, Distortion::kRadTan);
  EXPECT_EQ(camera.calibration.coefficients[3], 0.002);
  EXPECT_EQ(camera.calibration.coefficients[4], 0.0);
  EXPECT_EQ(camera.time_offset_ns, -2'100'000);
  // T_cam_imu maps the IMU's origin to (0.1, 0.2, 0.3) in the camera: forward in the IMU is z.
  EXPECT_TRUE((camera.T_imu_cam * Eigen::Vector3d(0.1, 0.2, 0.3)).isZero(1e-12));
  EXPECT_TRUE((camera.T_imu_cam.R * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d::UnitX()));
  EXPECT_TRUE(config.estimator.models.camera.T_cam_imu.p.isApprox(Eigen::Vector3d(0.1, 0.2, 0.3)));
  EXPECT_EQ(config.estimator.models.imu.gyro_random_walk, 4e-6);
  EXPECT_EQ(config.estimator.models.imu_rate_hz, 200.0);
}

TEST_F(ConfigTest, ReadsImuFileBelowImu0) {
  write("imu.yaml", "imu0:\n  " + std::regex_replace(kImu, std::regex("\n(?=.)"), "\n  "));
  EXPECT_EQ(load().estimator.models.imu.accel_noise_density, 0.01);
}

TEST_F(ConfigTest, UnknownKeyIsNamedWithItsLine) {
  EXPECT_THAT(complaint_with("speed:\n  std_sideways_mps: 1.0\n"),
              HasSubstr("vehicle.yaml:13: speed.std_sideways_mps: unknown key"));
  EXPECT_THAT(complaint_with("sped: {}\n"), HasSubstr("vehicle.yaml:12: sped: unknown key"));
}

TEST_F(ConfigTest, WrongTypeIsNamedWithItsLine) {
  EXPECT_THAT(complaint_with("speed:\n  std_forward_mps: abc\n"),
              HasSubstr("vehicle.yaml:13: speed.std_forward_mps: expected a number in (0, 10], "
                        "found 'abc'"));
  EXPECT_THAT(complaint_with("speed: 7\n"), HasSubstr(":12: speed: expected a map"));
  EXPECT_THAT(complaint_with("matching: {threads: 1.5}\n"), HasSubstr("whole number"));
  EXPECT_THAT(complaint_with("speed: {use: maybe}\n"), HasSubstr("true or false"));
}

TEST_F(ConfigTest, ValueOutOfRangeIsRejected) {
  for (const char* value : {"0", "-1", "10.5", ".nan", ".inf", "[1]", "1e999"}) {
    EXPECT_THAT(complaint_with("speed: {std_forward_mps: " + std::string(value) + "}\n"),
                HasSubstr("speed.std_forward_mps: expected a number in (0, 10]"))
        << value;
  }
  EXPECT_THAT(complaint_with("vehicle: {wheel_reference_imu_m: [1, 2]}\n"),
              HasSubstr("expected a list of 3 numbers, found a list of 2"));
}

TEST_F(ConfigTest, MatchingKeyOutOfRangeIsNamedWithItsOwnLine) {
  const std::pair<const char*, const char*> refused[] = {
      {"width_px: 4096", "width_px: expected a whole number in [64, 2048], found '4096'"},
      {"threads: 65", "threads: expected a whole number in [1, 64]"},
      {"min_matches: 3", "min_matches: expected a whole number in [4, 2048]"},
      {"focal_px: 9", "focal_px: expected a number in [10, 10000]"},
      {"guided: {ratio: 0.05}", "guided.ratio: expected a number in [0.1, 1]"},
      {"guided: {gate_sigmas: 11}", "guided.gate_sigmas: expected a number in [1, 10]"},
      {"guided: {min_gate_px: 20, max_gate_px: 10}",
       "guided.max_gate_px: expected a number in [20, 10000], found '10'"},
      {"outliers: {method: magic}", "outliers.method: expected one of paper, robust, none"},
  };
  for (const auto& [line, what] : refused) {
    EXPECT_THAT(complaint_with("matching:\n  matcher: mutual\n  " + std::string(line) + "\n"),
                HasSubstr("vehicle.yaml:14: matching." + std::string(what)));
  }
}

TEST_F(ConfigTest, DefaultThatDoesNotGoWithAnotherKeyIsNamed) {
  EXPECT_THAT(complaint_with("matching: {max_features: 32}\n"),
              HasSubstr("vehicle.yaml:12: matching.min_features: expected a number in [0, 32], "
                        "found none, and the default is 50"));
}

TEST_F(ConfigTest, AnEmptyNameTurnsAnLcmChannelOff) {
  write("vehicle.yaml", kVehicle + "live: {lcm: {channels: {estimate: \"\"}}}\n");
  const LcmChannels channels = load().live.channels;
  EXPECT_EQ(channels.estimate, "");
  EXPECT_EQ(channels.pose, LcmChannels{}.pose);
}

TEST_F(ConfigTest, WhatTheReaderTakesTheMatcherTakes) {
  write("vehicle.yaml", std::string(kVehicle) +
                            "matching: {width_px: 2048, threads: 64, min_matches: 4, focal_px: 10,"
                            " guided: {gate_sigmas: 10, ratio: 0.1}}\n");
  EXPECT_NO_THROW(validate(load().matching));
}

TEST_F(ConfigTest, MissingKeyIsNamed) {
  write("vehicle.yaml", replaced(kVehicle, "  calibration: imu.yaml\n", "  {}\n"));
  EXPECT_THAT(complaint(), HasSubstr("imu.calibration: missing"));
  write("vehicle.yaml", replaced(kVehicle, "format: 1\n", ""));
  EXPECT_THAT(complaint(), HasSubstr("format: missing"));
}

TEST_F(ConfigTest, MissingFileIsNamed) {
  std::filesystem::remove(dir_ / "camchain.yaml");
  EXPECT_THAT(complaint(),
              AllOf(HasSubstr("camera.calibration: no such file"), HasSubstr("camchain.yaml")));
  std::filesystem::remove(dir_ / "vehicle.yaml");
  EXPECT_THAT(complaint(), HasSubstr("vehicle.yaml: cannot be read"));
}

TEST_F(ConfigTest, RepeatedKeyIsRejected) {
  EXPECT_THAT(complaint_with("name: again\n"), HasSubstr(":12: name: the key is there twice"));
}

TEST_F(ConfigTest, BrokenYamlIsRejectedWithItsLine) {
  EXPECT_THAT(complaint_with("speed: [1, 2\n"), HasSubstr("not YAML"));
  write("vehicle.yaml", std::string(1000, '['));
  complaint();
}

TEST_F(ConfigTest, OtherFormatVersionIsRejected) {
  write("vehicle.yaml", replaced(kVehicle, "format: 1", "format: 2"));
  EXPECT_THAT(complaint(), HasSubstr("vehicle.yaml:1: format"));
}

TEST_F(ConfigTest, CameraThatIsNoRigidTransformIsRejected) {
  write("camchain.yaml", replaced(kCamchain, "[1.0, 0.0, 0.0, 0.3]", "[-1.0, 0.0, 0.0, 0.3]"));
  EXPECT_THAT(complaint(), HasSubstr("camchain.yaml:9: cam0.T_cam_imu: its rotation part"));
  write("camchain.yaml", replaced(kCamchain, "[1.0, 0.0, 0.0, 0.3]", "[1.01, 0.0, 0.0, 0.3]"));
  EXPECT_THAT(complaint(), HasSubstr("its rotation part"));
  write("camchain.yaml", replaced(kCamchain, "[1.0, 0.0, 0.0, 0.3]", "[1.0, 0.0, 0.3]"));
  EXPECT_THAT(complaint(), HasSubstr("expected 4 rows of 4"));
}

TEST_F(ConfigTest, OtherCameraModelsAreRejected) {
  write("camchain.yaml", replaced(kCamchain, "pinhole", "omni"));
  EXPECT_THAT(complaint(), HasSubstr("cam0.camera_model: expected one of pinhole"));
  write("camchain.yaml", replaced(kCamchain, "radtan", "equidistant"));
  EXPECT_EQ(load().camera.kalibr.calibration.distortion, Distortion::kEquidistant);
  write("camchain.yaml", replaced(kCamchain, "[-0.3, 0.1, 0.001, 0.002]", "[-0.3]"));
  EXPECT_THAT(complaint(), HasSubstr("distortion_coeffs: expected a list of 4 to 5 numbers"));
}

/// Keys of the table in docs/vehicle-config.md.
std::set<std::string> documented_keys(const std::string& pattern = "([a-z0-9_.]+)") {
  std::ifstream file(std::string(TOPOLOC_SOURCE_DIR) + "/docs/vehicle-config.md");
  std::set<std::string> keys;
  const std::regex row("^\\| `" + pattern + "` \\|.*");
  std::string line;
  for (std::smatch match; std::getline(file, line);) {
    if (std::regex_match(line, match, row)) {
      keys.insert(match[1]);
    }
  }
  return keys;
}

TEST_F(ConfigTest, DocumentsExactlyTheKeysThatTheReaderKnows) {
  const std::set<std::string> documented = documented_keys();
  // The sections are those of the documented keys; each lists the keys that it knows when it is
  // given one that it does not.
  std::set<std::string> sections{""};
  for (const std::string& key : documented) {
    for (std::size_t dot = key.find('.'); dot != std::string::npos; dot = key.find('.', dot + 1)) {
      sections.insert(key.substr(0, dot));
    }
  }
  std::set<std::string> known;
  const std::regex listed("\\(known here: (.*)\\)");
  for (const std::string& section : sections) {
    // The base file, with the unknown key put into the section as a path of nested maps.
    YAML::Node root = YAML::Load(kVehicle);
    YAML::Node node = root;
    std::stringstream path(section);
    for (std::string part; std::getline(path, part, '.');) {
      node.reset(node[part]);
    }
    node["zzz"] = 1;
    write("vehicle.yaml", YAML::Dump(root));
    const std::string what = complaint();
    std::smatch match;
    ASSERT_TRUE(std::regex_search(what, match, listed)) << section << ": " << what;
    std::stringstream keys(match[1]);
    for (std::string key; std::getline(keys, key, ',');) {
      key.erase(0, key.find_first_not_of(' '));
      known.insert((section.empty() ? "" : section + ".") + key);
    }
  }
  for (const std::string& section : sections) {
    known.erase(section);
  }
  EXPECT_EQ(known, documented);
}

std::string with_check(const std::string& check) {
  return replaced(kVehicle, "  imu:\n", "  checks:\n  - " + check + "\n  imu:\n");
}

TEST_F(ConfigTest, ReadsCountersAndChecksums) {
  write("vehicle.yaml", with_check("{message: A, interface: can0, counter: C, counter_max: 14, "
                                   "checksum: S, algorithm: e2e-profile1, data_id: 0x1A2B}"));
  const auto checks = load().can.checks;
  ASSERT_EQ(checks.size(), 1U);
  EXPECT_EQ(checks[0].message, "A");
  EXPECT_EQ(checks[0].interface, "can0");
  EXPECT_EQ(checks[0].counter, "C");
  EXPECT_EQ(checks[0].counter_max, 14U);
  EXPECT_EQ(checks[0].checksum, "S");
  EXPECT_EQ(checks[0].algorithm, can::Checksum::kE2eProfile1);
  EXPECT_EQ(checks[0].data_id, 0x1A2B);
  EXPECT_THAT(checks[0].place, HasSubstr("vehicle.yaml:6: can.checks[0].message"));
}

TEST_F(ConfigTest, ChecksThatSayTooLittleOrTooMuchAreNamedWithTheirLine) {
  const auto refused = [&](const std::string& check, const std::string& why) {
    write("vehicle.yaml", with_check(check));
    EXPECT_THAT(complaint(), AllOf(HasSubstr("vehicle.yaml:6: can.checks[0]"), HasSubstr(why)));
  };
  refused("{counter: C}", "message: missing");
  refused("{message: A}", "expected a counter or a checksum");
  refused("{message: A, checksum: S}", "algorithm: missing");
  refused("{message: A, checksum: S, algorithm: md5}", "expected one of xor8");
  refused("{message: A, checksum: S, algorithm: xor8, data_id: 65536}", "from 0 to 65535");
  refused("{message: A, counter: C, data_id: 1}", "data_id: unknown key");
}

TEST_F(ConfigTest, DocumentsTheKeysOfChecks) {
  write("vehicle.yaml", with_check("{message: A, checksum: S, algorithm: xor8, zzz: 1}"));
  const std::string what = complaint();
  std::set<std::string> known;
  std::smatch match;
  ASSERT_TRUE(std::regex_search(what, match, std::regex("\\(known here: (.*)\\)"))) << what;
  std::stringstream keys(match[1]);
  for (std::string key; std::getline(keys, key, ',');) {
    known.insert(key.substr(key.find_first_not_of(' ')));
  }
  EXPECT_EQ(known, documented_keys("checks\\[\\]\\.([a-z_]+)"));
}

TEST(ExampleConfig, IsValid) {
  const VehicleConfig vehicle = load_vehicle_config(std::filesystem::path(TOPOLOC_SOURCE_DIR) /
                                                    "config" / "example" / "vehicle.yaml");
  EXPECT_TRUE(vehicle.camera.configured());
  // The camera of the example is 1 m ahead of the IMU and 0.5 m above it, and looks ahead.
  const RigidTransform& T_imu_cam = vehicle.camera.kalibr.T_imu_cam;
  EXPECT_TRUE(T_imu_cam.p.isApprox(Eigen::Vector3d(1.0, 0.0, 0.5)));
  EXPECT_TRUE((T_imu_cam.R * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d::UnitX()));
  EXPECT_EQ(vehicle.live.can_interfaces, std::vector<std::string>{"can0"});
}

}  // namespace
}  // namespace topoloc::config
