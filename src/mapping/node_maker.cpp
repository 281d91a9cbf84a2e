// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mapping/node_maker.hpp"

#include "topoloc/drive/drive.hpp"
#include "topoloc/geometry/so3.hpp"
#include "topoloc/map/depth_codec.hpp"
#include "topoloc/map/feature_record.hpp"
#include "topoloc/map/intensity_codec.hpp"

#include "mapping/intensity_image.hpp"

#include <opencv2/imgcodecs.hpp>

namespace topoloc::mapping {
namespace {

/// Workers run side by side, so the model inside each of them gets one thread.
matching::MatchingConfig single_threaded(matching::MatchingConfig config) {
  config.threads = 1;
  return config;
}

std::vector<std::byte> encode_jpeg(const cv::Mat& grey) {
  constexpr int kQuality = 90;
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", grey, bytes, {cv::IMWRITE_JPEG_QUALITY, kQuality});
  const auto* data = reinterpret_cast<const std::byte*>(bytes.data());
  return {data, data + bytes.size()};
}

}  // namespace

Eigen::Matrix<double, 6, 6> node_covariance(const PlannedNode& node,
                                            const RigidTransform& T_imu_cam) {
  // R_cam_true = R Exp(theta) R_imu_cam = R_cam Exp(R_imu_cam^T theta), and the camera sits on a
  // lever: p_cam_true = p_cam + R t - R [p_imu_cam]x theta.
  const Eigen::Matrix3d& R = node.T_world_imu.R;
  Eigen::Matrix<double, 6, 6> J = Eigen::Matrix<double, 6, 6>::Zero();
  J.topLeftCorner<3, 3>() = T_imu_cam.R.transpose();
  J.bottomLeftCorner<3, 3>() = -R * so3::skew(T_imu_cam.p);
  J.bottomRightCorner<3, 3>() = R;
  const Eigen::Matrix<double, 6, 6> P = J * node.covariance * J.transpose();
  return 0.5 * (P + P.transpose());
}

NodeMaker::NodeMaker(const NodeContext& context)
    : context_(context),
      T_imu_cam_(context.vehicle.camera.kalibr.T_imu_cam),
      undistorter_(context.vehicle.camera.kalibr.calibration,
                   matching::matching_camera(context.vehicle.matching)),
      extractor_(matching::make_extractor(single_threaded(context.vehicle.matching))),
      features_(extractor_->max_features(), extractor_->identity().descriptor_dim) {
  extractor_->set_mask(undistorter_.mask(drive::read_mask(context.vehicle.camera),
                                         context.vehicle.matching.mask_erosion_px));
}

NodeOutcome NodeMaker::make(const PlannedNode& node, const cv::Mat& raw) {
  if (raw.empty()) {
    return {NodeReject::kUndecodableImage, {}, {}};
  }
  NodeOutcome outcome;
  const RigidTransform T_world_cam = node.T_world_imu * T_imu_cam_;
  const RenderedView view =
      render(context_.grid, undistorter_.target(), T_world_cam, context_.config.render);
  outcome.figures["coverage"] = view.coverage();
  if (view.coverage() < context_.config.min_coverage) {
    outcome.rejected = NodeReject::kCloudNotInView;
    return outcome;
  }
  undistorter_.undistort(raw, undistorted_);
  extractor_->extract(undistorted_, features_);

  map::NodeDraft draft;
  int lifted = 0;
  double depth_std_sum_m = 0.0;
  for (int i = 0; i < features_.count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Lift lift =
        mapping::lift(view, features_.pixels_px[at].cast<double>(), context_.config.lift);
    if (lift.verdict == LiftVerdict::kLifted) {
      ++lifted;
      depth_std_sum_m += lift.depth_std_m;
    }
    draft.features.push_back({features_.pixels_px[at], static_cast<float>(lift.depth_m),
                              static_cast<float>(lift.depth_std_m), features_.scores[at]});
  }
  outcome.figures["features"] = features_.count;
  outcome.figures["lifted"] = lifted;
  if (lifted > 0) {
    outcome.figures["mean_depth_std_m"] = depth_std_sum_m / lifted;
  }
  if (features_.count < context_.config.min_features) {
    outcome.rejected = NodeReject::kTooFewFeatures;
    return outcome;
  }
  if (lifted < context_.config.min_lifted) {
    outcome.rejected = NodeReject::kTooFewLifted;
    return outcome;
  }
  const std::size_t values =
      draft.features.size() * static_cast<std::size_t>(features_.descriptor_dim);
  draft.descriptors.resize(values);
  map::encode_descriptors(std::span(features_.descriptors).first(values), draft.descriptors);
  draft.time_ns = node.time_ns;
  draft.T_world_cam = T_world_cam;
  draft.covariance = node_covariance(node, T_imu_cam_);
  draft.camera_image = encode_jpeg(undistorted_);
  draft.depth_image = map::encode_depth(view.depth_m, view.camera.width_px, view.camera.height_px);
  if (context_.grid.cloud().has_intensity) {
    draft.intensity_image =
        map::encode_intensity(intensity_image(view), view.camera.width_px, view.camera.height_px);
  }
  outcome.draft = std::move(draft);
  return outcome;
}

}  // namespace topoloc::mapping
