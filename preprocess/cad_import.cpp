#include "preprocess/cad_import.h"

namespace trimray {

Result<CadModel> import_cad(const std::string& path, const ImportOptions&, const Progress&)
{
    return Error{ErrorCode::UnsupportedFormat, path, "no reader yet"};
}

} // namespace trimray
