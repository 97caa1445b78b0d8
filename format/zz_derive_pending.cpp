// Weak stand-ins until the derivations land; each is replaced by its real function at link time.
#include "format/derive.h"

namespace trimray {
__attribute__((weak)) void derive_leaves(PackImage&, const LeafOptions&) {}
__attribute__((weak)) void derive_trees(PackImage&) {}
__attribute__((weak)) void derive_cells(PackImage&) {}
__attribute__((weak)) void derive_sdf(PackImage&) {}
} // namespace trimray
