// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/video_file.hpp"

#include "topoloc/camera/image_form.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>

#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

namespace topoloc::camera {

struct VideoImages::Decoder {
  cv::VideoCapture video;
  cv::Mat frame;
  cv::Mat grey;
};

VideoImages::VideoImages(std::filesystem::path file)
    : file_(std::move(file)), decoder_(std::make_unique<Decoder>()) {
  if (!std::filesystem::is_regular_file(file_)) {
    // OpenCV would take such a name for a pattern of image files, or for a stream.
    throw std::runtime_error(file_.string() + ": no such video file");
  }
  open();
}

VideoImages::~VideoImages() = default;

void VideoImages::open() {
  if (!decoder_->video.open(file_.string())) {
    throw std::runtime_error(file_.string() +
                             ": not a video that OpenCV can read here (ffmpeg -i FILE says what it "
                             "is and can write images of it for --folder)");
  }
}

double VideoImages::fps() const {
  const double fps = decoder_->video.get(cv::CAP_PROP_FPS);
  return std::isfinite(fps) && fps > 0.0 ? fps : 0.0;
}

Read VideoImages::next(image_t& image) {
  // A damaged frame is skipped by the decoder itself, which does not say so.
  if (!decoder_->video.read(decoder_->frame) || decoder_->frame.empty()) {
    return Read::kEnd;
  }
  ++frame_;
  const cv::Mat& frame = decoder_->frame;
  if (frame.channels() == 1) {
    frame.copyTo(decoder_->grey);
  } else {
    cv::cvtColor(frame, decoder_->grey, cv::COLOR_BGR2GRAY);
  }
  const cv::Mat& grey = decoder_->grey;
  image.nmetadata = 0;
  image.metadata.clear();
  image.data.assign(grey.datastart, grey.dataend);
  set_grey(image, {.width_px = grey.cols, .height_px = grey.rows});
  return Read::kImage;
}

void VideoImages::rewind() {
  decoder_->video.release();  // seeking is not exact in every container
  open();
  frame_ = 0;
}

std::string VideoImages::place() const {
  return file_.string() + ": frame " + std::to_string(frame_);
}

}  // namespace topoloc::camera
