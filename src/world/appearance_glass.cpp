// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/patterns.hpp"

#include <algorithm>
#include <cmath>

/// Windows and doors: what is behind glass, and what is around it.
namespace topoloc::world::patterns {

using namespace noise;

namespace {

constexpr float kGlassNir = 0.04F;  // a LiDAR's beam goes through or is mirrored away

// Light of lamps on what is behind the glass at night. An irradiance of 1 is 100,000 lx; things of
// a shop then throw back 20 to 200 cd/m2.
constexpr float kRoomLight = 200.0F / 1e5F;
constexpr float kShopLight = 1000.0F / 1e5F;

// Share of a spot on the frame of a pane and its bars.
float frame_share(const Spot& s) {
  constexpr float kFrame_m = 0.065F;
  const float w = s.p[0];
  const float h = s.p[1];
  float glass = band(s.u, kFrame_m, w - kFrame_m, s.footprint) *
                band(s.v, kFrame_m, h - kFrame_m, s.footprint);
  switch (static_cast<int>(s.p[2])) {
    case 2:
      glass *= 1.0F - band(s.v, 0.68F * h, 0.68F * h + 0.05F, s.footprint);
      [[fallthrough]];
    case 0:
      glass *= 1.0F - band(s.u, 0.5F * w - 0.04F, 0.5F * w + 0.04F, s.footprint);
      break;
    case 4: {
      const float px = w / std::max(2.0F, std::round(w / 0.42F));
      const float py = h / std::max(2.0F, std::round(h / 0.42F));
      glass *= 1.0F - repeated(s.u + 0.015F, px, 0.03F, s.footprint);
      glass *= 1.0F - repeated(s.v + 0.015F, py, 0.03F, s.footprint);
      break;
    }
    default:
      break;
  }
  return 1.0F - glass;
}

// Visible light out of a room by day: curtains, blinds, plants on the sill, or just dark.
float behind(const Spot& s) {
  const float w = s.p[0];
  const float h = s.p[1];
  const std::uint32_t key = hash(s.seed, 0U, 70U);
  const float room =
      0.05F + 0.05F * octave(s.u, s.v, 0.4F, s.seed, s.footprint) + 0.03F * unit(again(key));
  switch (key % 7U) {
    case 0:
    case 1: {  // curtains at the sides
      const float wide = w * (0.12F + 0.22F * unit(key + 1U));
      const float share = 1.0F - band(s.u, wide, w - wide * 1.1F, s.footprint);
      const float folds = 0.5F + octave(s.u, s.v * 0.05F, 0.045F, s.seed + 1U, s.footprint);
      return mix(room, 0.12F + 0.3F * unit(key + 2U) * (0.5F + folds), share);
    }
    case 2: {  // net curtain
      const float folds = octave(s.u, s.v * 0.04F, 0.06F, s.seed + 2U, s.footprint);
      const float bottom = h * (0.1F + 0.3F * unit(key + 3U));
      const float share = band(s.v, bottom, 10.0F, s.footprint);
      return mix(room, 0.36F * (1.0F + 0.5F * folds), share);
    }
    case 3: {  // blinds
      const float bottom = h * (0.15F + 0.7F * unit(key + 4U));
      const float share = band(s.v, bottom, 10.0F, s.footprint);
      const float slats = repeated(s.v, 0.05F, 0.025F, s.footprint);
      return mix(room, 0.25F + 0.25F * slats, share);
    }
    case 4: {  // roller shutter, part of the way
      const float bottom = h * (0.9F * unit(key + 5U));
      const float share = band(s.v, bottom, 10.0F, s.footprint);
      const float slats = repeated(s.v, 0.055F, 0.008F, s.footprint);
      return mix(room, 0.5F * (1.0F - 0.5F * slats), share);
    }
    case 5: {  // plants on the sill
      const float leaves = value(s.u / 0.11F, s.v / 0.11F, s.seed + 3U) - s.v / (0.6F * h);
      return mix(room, 0.14F, ramp(leaves, 0.0F, 0.1F) * fade(0.1F, s.footprint));
    }
    default:
      return room;
  }
}

// What glass mirrors of the other side of the street, without tracing it.
float reflection(const Spot& s) {
  const float sky =
      ramp(s.v / std::max(0.5F, s.p[1]) + 0.7F * octave(s.u, s.v, 0.45F, s.seed + 4U, s.footprint),
           0.35F + 0.5F * unit(s.seed + 5U), 0.5F + 0.5F * unit(s.seed + 5U));
  return 0.22F * sky * unit(s.seed + 6U);
}

}  // namespace

// p: width, height, layout of bars, tone of the frame.
Appearance window(const Spot& s) {
  const float frame = frame_share(s);
  const float room = behind(s);
  const float dirt = 0.12F * octave(s.u, s.v, 0.2F, s.seed + 7U, s.footprint);
  const bool lit = unit(s.seed + 8U) < 0.3F;  // a lamp behind; seen at night
  return {mix(room + reflection(s), s.p[3] * (1.0F + dirt), frame), mix(kGlassNir, 0.45F, frame),
          0.0F, lit ? kRoomLight * room * (1.0F - frame) : 0.0F, 0.22F * (1.0F - frame)};
}

// p: width, height.
Appearance shop_front(const Spot& s) {
  const float w = s.p[0];
  const float h = s.p[1];
  constexpr float kFrame_m = 0.05F;
  const float glass = band(s.u, kFrame_m, w - kFrame_m, s.footprint) *
                      band(s.v, kFrame_m, h - kFrame_m, s.footprint);
  // Goods on shelves.
  const std::uint32_t key = hash(s.seed, 1U, 71U);
  const float size = 0.16F + 0.3F * unit(key);
  const std::uint32_t thing = hash(cell(s.u / size), cell(s.v / size), s.seed);
  const float x = s.u / size - whole(s.u / size);
  const float y = s.v / size - whole(s.v / size);
  const float f = s.footprint / size;
  float inside = 0.06F;
  if (s.v < 0.68F * h) {
    const float share = band(x, 0.15F + 0.2F * unit(thing), 0.6F + 0.35F * unit(thing + 1U), f) *
                        band(y, 0.05F, 0.4F + 0.5F * unit(thing + 2U), f);
    inside = mix(inside, 0.08F + 0.6F * unit(thing + 3U), share);
    inside = mix(inside, 0.3F, band(y, 0.0F, 0.06F, f));
  }
  inside += 0.06F * octave(s.u, s.v, 0.06F, s.seed + 2U, s.footprint);
  const float lit = kShopLight * std::max(0.0F, inside);
  inside += reflection(s);
  // Posters and letters on the pane: bright by day, dark before the lit shop.
  const float band_v = (s.v - 0.72F * h) / 0.24F;
  const float ink = lettering((s.u - 0.15F) / 0.24F, band_v, s.footprint / 0.24F, key,
                              static_cast<int>((w - 0.3F) / 0.16F));
  inside = mix(inside, 0.75F, ink);
  const float px = 0.3F + (w - 1.1F) * unit(key + 4U);
  const float poster = band(s.u, px, px + 0.5F, s.footprint) * band(s.v, 0.3F, 1.0F, s.footprint) *
                       (unit(key + 5U) < 0.6F ? 1.0F : 0.0F);
  const float print =
      lettering((s.u - px - 0.05F) / 0.14F, std::fmod(std::max(0.0F, s.v - 0.35F), 0.2F) / 0.14F,
                s.footprint / 0.14F, key + cell(s.v / 0.2F), 5);
  inside = mix(inside, mix(0.7F, 0.12F, print), poster);
  return {mix(0.2F, inside, glass), mix(0.4F, mix(kGlassNir, 0.25F, poster), glass), 0.0F,
          lit * (1.0F - ink) * (1.0F - poster) * glass, 0.22F * glass};
}

// p: width, height, layout, tone.
Appearance door(const Spot& s) {
  const float w = s.p[0];
  const float h = s.p[1];
  const int layout = static_cast<int>(s.p[2]);
  const float x = s.u - 0.5F * w;
  const float grain = 0.25F * octave(s.u * 4.0F, s.v * 0.5F, 0.12F, s.seed, s.footprint) +
                      0.15F * octave(s.u, s.v, 0.5F, s.seed + 1U, s.footprint);
  float albedo = s.p[3] * (1.0F + grain);
  float nir = 0.42F * (1.0F + 0.4F * grain);
  // Panels: a dark and a light edge each.
  const float px = std::abs(x) - 0.25F * w;
  for (int i = 0; i < (layout == 3 ? 1 : 2); ++i) {
    const float low = (i == 0 ? 0.12F : 0.52F) * h;
    const float high = (i == 0 && layout != 3 ? 0.46F : 0.92F) * h;
    const float inner =
        band(px, -0.15F * w, 0.15F * w, s.footprint) * band(s.v, low, high, s.footprint);
    const float outer = band(px, -0.15F * w - 0.025F, 0.15F * w + 0.025F, s.footprint) *
                        band(s.v, low - 0.025F, high + 0.025F, s.footprint);
    albedo *= 1.0F - 0.5F * (outer - inner);
    nir *= 1.0F - 0.4F * (outer - inner);
    if (i == 1 && layout < 2) {
      albedo = mix(albedo, 0.09F + reflection(s), inner);
      nir = mix(nir, kGlassNir, inner);
    }
  }
  const float gap = band(x, -0.006F, 0.006F, s.footprint) * (layout % 2 == 0 ? 1.0F : 0.0F);
  const float handle = band(x, 0.06F, 0.1F, s.footprint) * band(s.v, 0.95F, 1.12F, s.footprint);
  albedo = mix(albedo * (1.0F - 0.8F * gap), 0.6F, handle);
  return {albedo, mix(nir, 0.6F, handle), 0.0F, 0.0F, 0.05F};
}

}  // namespace topoloc::world::patterns
