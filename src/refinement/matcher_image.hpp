// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/mapping/render.hpp"
#include "topoloc/matching/image_pair_matcher.hpp"

namespace topoloc::refinement {

/// The intensities of a view as a matcher of camera images can read them: root of the mean of the
/// points around, which fills small holes and gaps between scan lines, stretched so that 2 % of
/// what is seen turn black and 2 % white. (Equalising the histogram would make stripes on tarmac as
/// strong as a car.) Where the cloud shows nothing the image is of middle grey and masked. Size of
/// the view.
matching::MaskedImage matcher_image(const mapping::RenderedView& view);

}  // namespace topoloc::refinement
