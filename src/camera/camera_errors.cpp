// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "camera/camera_errors.hpp"

#include <cerrno>
#include <system_error>

namespace topoloc::camera {
namespace {

const char* remedy(int error) {
  switch (error) {
    case ENOENT:
    case ENODEV:
    case ENXIO:
      return "is it plugged in? topoloc-camera --list shows which there are";
    case EACCES:
    case EPERM:
      return "the user has to be in group video: sudo usermod -aG video USER, then log in again";
    case EBUSY:
      return "another program uses it: fuser -v DEVICE tells which";
    case ENOSPC:
      return "the USB bus is full: another port, --format mjpeg, or a lower size or rate";
    default:
      return nullptr;
  }
}

}  // namespace

std::string camera_error_text(const std::string& device, const std::string& what, int error) {
  std::string text = device + ": " + what;
  if (error != 0) {
    text += " (" + std::generic_category().message(error) + ")";
    if (const char* const to_do = remedy(error); to_do != nullptr) {
      text += std::string(": ") + to_do;
    }
  }
  return text;
}

}  // namespace topoloc::camera
