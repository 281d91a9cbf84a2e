// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/drive_folder.hpp"

#include <cerrno>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <system_error>

namespace topoloc::simulation {
namespace fs = std::filesystem;
namespace {

/// A new folder beside another, of which nothing is left in the end.
class Workshop {
 public:
  explicit Workshop(const fs::path& out) {
    std::string pattern = out.string() + ".partial-XXXXXX";
    if (::mkdtemp(pattern.data()) == nullptr) {
      throw std::system_error(errno, std::generic_category(), out.string() + ": cannot be made");
    }
    path_ = pattern;
  }
  ~Workshop() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Workshop(const Workshop&) = delete;
  Workshop& operator=(const Workshop&) = delete;

  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

}  // namespace

void require_free(const fs::path& out, bool force) {
  if (!fs::exists(out)) {
    return;
  }
  if (!fs::is_directory(out)) {
    throw std::runtime_error(out.string() + " exists and is not a folder");
  }
  if (fs::is_empty(out)) {
    return;
  }
  if (!fs::exists(out / "vehicle.yaml")) {
    throw std::runtime_error(out.string() + " exists and is not a drive folder");
  }
  if (!force) {
    throw std::runtime_error(out.string() + " exists (--force replaces it)");
  }
}

void create_folder(const fs::path& given, bool force,
                   const std::function<void(const fs::path&)>& fill) {
  fs::path out = fs::absolute(given).lexically_normal();
  if (!out.has_filename()) {  // "drive/"
    out = out.parent_path();
  }
  require_free(out, force);
  fs::create_directories(out.parent_path());
  const Workshop workshop(out);
  // The workshop is its owner's alone; what others may do with the drive is for the umask to say.
  const fs::path made = workshop.path() / out.filename();
  fs::create_directory(made);
  fill(made);
  require_free(out, force);  // another run may have been faster
  if (force) {
    fs::remove_all(out);
  }
  fs::rename(made, out);
}

}  // namespace topoloc::simulation
