// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/types.hpp"

#include <iomanip>
#include <sstream>

namespace topoloc::map {

std::string to_string(const ModelIdentity& model) {
  std::ostringstream s;
  s << model.name << " (" << model.descriptor_dim << "-d, fingerprint " << std::hex
    << std::setfill('0') << std::setw(16) << model.fingerprint << ")";
  return s.str();
}

}  // namespace topoloc::map
