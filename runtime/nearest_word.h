// The word that was meant, of those that are known: for messages about misspelt options, commands and keys.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace trimray {

/// The candidate nearest to `word` by edits (insert, delete, replace, swap of neighbours), or "" if none is near:
/// at most a third of the word's letters, at least one, may differ.
std::string nearest_word(std::string_view word, const std::vector<std::string>& candidates);

/// "; did you mean '<nearest>'?", or "" if none is near.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates);

} // namespace trimray
