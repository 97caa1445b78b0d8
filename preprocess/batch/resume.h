// Which files an earlier run has settled, so that a run that goes on need not even open them.
#pragma once

#include "preprocess/batch/file_class.h"
#include "preprocess/batch/inputs.h"
#include "preprocess/batch/ledger.h"
#include "preprocess/batch/store.h"

#include <set>
#include <string>
#include <unordered_map>
#include <vector>

namespace trimray {

/// The files that are not settled. One is settled if the ledger has its end, made with the same `basis` (options and
/// versions), its size and time are as then, its class is not one to `retry`, and its pack, if it had one, is there.
std::vector<BatchFile> unsettled(std::vector<BatchFile> files, const Store& store, const std::string& basis,
                                 const std::set<FileClass>& retry,
                                 const std::unordered_map<std::string, FileState>& states);

} // namespace trimray
