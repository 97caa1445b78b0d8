// Filter 2: what a section's words are beside what the words before them lead to expect. Control nets, trims, trees and
// textures become small numbers, which the columns of filter 1 and zstd then make short. SPEC.md, "Filter 2".
#pragma once

#include "format/pack_image.h"

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

namespace trimray {

/// Whether filter 2 is defined for section `id`.
bool has_prediction(std::string_view id);

/// The records of section `id` as differences from their prediction, or nothing where they do not come back exactly
/// (numbers off the grid, a tree in another order). `image` holds the sections that come before it in a file.
/// Domain: has_prediction(id); records: whole ones.
std::vector<std::byte> predict_records(std::string_view id, const PackImage& image, std::span<const std::byte> records);

/// The inverse, in place. Any bytes give some records: what they are worth is the validator's to say.
void restore_records(std::string_view id, const PackImage& image, std::span<std::byte> records);

} // namespace trimray
