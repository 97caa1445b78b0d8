// Words of command lines that we print, for others to run again.
#pragma once

#include <string>

namespace trimray {

/// `word` as a shell takes it: quoted where it has to be.
std::string shell_word(const std::string& word);

} // namespace trimray
