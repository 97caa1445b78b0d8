// Which files hold CAD models, by their names alone.
#pragma once

#include <optional>
#include <string_view>

namespace trimray {

enum class CadFamily { Step, Iges, Brep };

/// By the name's ending, in capitals or not: .step .stp .p21, .iges .igs, .brep .brp .rle.
std::optional<CadFamily> cad_family(std::string_view name);

/// The name without ".zst" or ".gz" at its end.
std::string_view without_compression(std::string_view name);

/// Whether the name is that of a CAD file, compressed or not.
bool is_cad_name(std::string_view name);

/// What follows the last '/'.
std::string_view without_folder(std::string_view path);

} // namespace trimray
