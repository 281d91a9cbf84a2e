// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/image_folder.hpp"

#include "topoloc/camera/image_form.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

#include <opencv2/imgcodecs.hpp>

namespace topoloc::camera {
namespace {

namespace fs = std::filesystem;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Takes a run of digits off the front, without its leading zeros.
std::string_view take_number(std::string_view& text) {
  const auto end = std::find_if_not(text.begin(), text.end(), is_digit);
  std::string_view number = text.substr(0, static_cast<std::size_t>(end - text.begin()));
  text.remove_prefix(number.size());
  number.remove_prefix(std::min(number.find_first_not_of('0'), number.size()));
  return number;
}

std::string lower_extension(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

bool is_jpeg(const fs::path& file) {
  const std::string extension = lower_extension(file);
  return extension == ".jpg" || extension == ".jpeg";
}

bool is_image(const fs::path& file) {
  constexpr std::array<std::string_view, 5> kOthers = {".png", ".pgm", ".bmp", ".tif", ".tiff"};
  return is_jpeg(file) ||
         std::find(kOthers.begin(), kOthers.end(), lower_extension(file)) != kOthers.end();
}

bool read_jpeg(const fs::path& file, image_t& image) {
  std::ifstream stream(file, std::ios::binary);
  image.data.assign(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
  const std::optional<ImageSize> size = jpeg_size(image.data);
  if (stream.bad() || !size) {
    return false;
  }
  set_jpeg(image, *size);
  return true;
}

bool read_other(const fs::path& file, image_t& image) {
  cv::Mat grey;
  try {
    grey = cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception&) {
    return false;  // as any file that does not decode
  }
  if (grey.empty()) {
    return false;
  }
  image.data.assign(grey.datastart, grey.dataend);
  set_grey(image, {.width_px = grey.cols, .height_px = grey.rows});
  return true;
}

}  // namespace

bool name_precedes(std::string_view a, std::string_view b) {
  const std::string_view whole_a = a;
  const std::string_view whole_b = b;
  while (!a.empty() && !b.empty()) {
    if (is_digit(a.front()) && is_digit(b.front())) {
      const std::string_view number_a = take_number(a);
      const std::string_view number_b = take_number(b);
      if (number_a != number_b) {
        return number_a.size() != number_b.size() ? number_a.size() < number_b.size()
                                                  : number_a < number_b;
      }
    } else if (a.front() != b.front()) {
      return a.front() < b.front();
    } else {
      a.remove_prefix(1);
      b.remove_prefix(1);
    }
  }
  // Names that differ in leading zeros only have an order too.
  return a.empty() != b.empty() ? a.empty() : whole_a < whole_b;
}

std::vector<fs::path> list_images(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> files;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (is_image(it->path()) && it->is_regular_file()) {
      files.push_back(it->path());
    }
  }
  if (error) {
    throw std::runtime_error(folder.string() + ": cannot be read: " + error.message());
  }
  if (files.empty()) {
    throw std::runtime_error(folder.string() +
                             ": no images (.jpg, .jpeg, .png, .pgm, .bmp, .tif, .tiff)");
  }
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return name_precedes(a.filename().string(), b.filename().string());
  });
  return files;
}

Read FolderImages::next(image_t& image) {
  if (next_ == files_.size()) {
    return Read::kEnd;
  }
  const fs::path& file = files_[next_++];
  image.nmetadata = 0;
  image.metadata.clear();
  return (is_jpeg(file) ? read_jpeg(file, image) : read_other(file, image)) ? Read::kImage
                                                                            : Read::kUnreadable;
}

std::string FolderImages::place() const {
  return next_ == 0 ? std::string() : files_[next_ - 1].string();
}

}  // namespace topoloc::camera
