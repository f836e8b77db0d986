// SPDX-License-Identifier: Apache-2.0
// The verbs about archives of maps: backup, restore; what import and export share with them.
#pragma once

#include <functional>
#include <ostream>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "query/cli/session.h"
#include "schema/store/map_writer.h"

namespace dsg::cli {

/// What dsg export and dsg backup call archives.
inline bool IsArchivePath(const std::string& path) {
  return path.size() > 5 && path.ends_with(".dsgz");
}

struct RestoreVerb {
  /// The folder of a backup, or an archive.
  std::string path;
  /// Name of the map in the store; empty = the name in the archive.
  std::string as;
  bool force = false;
};

/// Puts the maps of a backup, or one archive, into a store.
///
/// Errors: as RestoreArchive, and then the map is unchanged.
absl::Status Restore(const CommonOptions& common, const RestoreVerb& verb, std::ostream& out,
                     std::ostream& notes);

/// Reads the archive of a map from a store or a server, and gives it to `write` piece by piece.
/// Errors: of ReadArchive; what `write` returns.
absl::Status CopyArchive(Session* session, const std::string& map, const query::CallContext& call,
                         const std::function<absl::Status(std::string_view)>& write,
                         const dsg::Progress& progress);

}  // namespace dsg::cli
