#include "runtime/nearest_word.h"

#include <algorithm>
#include <cstddef>

namespace trimray {
namespace {

/// Optimal string alignment distance: like Levenshtein's, and a swap of neighbours counts one.
size_t edit_distance(std::string_view a, std::string_view b)
{
    std::vector<std::vector<size_t>> d(a.size() + 1, std::vector<size_t>(b.size() + 1));
    for (size_t i = 0; i <= a.size(); ++i)
        for (size_t j = 0; j <= b.size(); ++j) {
            if (i == 0 || j == 0) {
                d[i][j] = i + j;
                continue;
            }
            d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
        }
    return d[a.size()][b.size()];
}

} // namespace

std::string nearest_word(std::string_view word, const std::vector<std::string>& candidates)
{
    constexpr size_t kLongest = 100; // letters: longer words are no misspelling, and the distance takes their square
    if (word.size() > kLongest)
        return "";
    std::string best;
    size_t best_distance = std::max<size_t>(1, word.size() / 3) + 1;
    for (const std::string& candidate : candidates) {
        const bool completes = word.size() >= 2 && candidate.starts_with(word); // "val" for "validate"
        const size_t distance = completes ? 0 : edit_distance(word, candidate);
        if (distance < best_distance) {
            best_distance = distance;
            best = candidate;
        }
    }
    return best;
}

std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates)
{
    const std::string near = nearest_word(word, candidates);
    return near.empty() ? "" : "; did you mean '" + near + "'?";
}

} // namespace trimray
