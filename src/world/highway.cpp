// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/verge.hpp"

namespace topoloc::world {

void make_highway(Maker& maker, const Section& section) {
  // Its grass begins where the town's footways end, which is within the town's section.
  double begin_m = maker.begin_m(section);
  double end_m = maker.end_m(section);
  if (&section != &maker.world.sections.front()) {
    const Section& before = *(&section - 1);
    while (before.setting == Setting::kTown && begin_m > before.begin_m &&
           open_country(maker, begin_m - 1.0)) {
      begin_m -= 1.0;
    }
  }
  while (begin_m < end_m && !open_country(maker, begin_m)) {
    begin_m += 1.0;
  }
  if (end_m - begin_m < 2.0) {
    return;
  }
  make_verge(maker, begin_m, end_m);
  make_barriers(maker, begin_m, end_m);
  make_overhead(maker, section, begin_m, end_m);
}

}  // namespace topoloc::world
