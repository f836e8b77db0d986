// SPDX-License-Identifier: Apache-2.0
// What command lines about keeping maps for years say: tag, compact, revert, backup, restore.
// Refuses to know what the words mean: names of revisions stay text until the map is open.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace dsg::cli {

/// A revision as it was written: its number, or a tag; neither = the verb's default.
struct RevisionOption {
  std::optional<int64_t> number;
  std::string tag;

  bool is_set() const { return number.has_value() || !tag.empty(); }
};

/// What dsg export and dsg backup call archives.
inline bool IsArchivePath(const std::string& path) {
  return path.size() > 5 && path.compare(path.size() - 5, 5, ".dsgz") == 0;
}

struct TagVerb {
  /// Set this one, at the common option --revision.
  std::string name;
  std::optional<std::string> note;
  std::string removed;
  bool list = false;
};

struct CompactVerb {
  RevisionOption keep_from;
};

struct RevertVerb {
  RevisionOption to;
  bool dry_run = false;
};

struct BackupVerb {
  std::string folder;
};

struct RestoreVerb {
  /// A backup's folder, or an archive.
  std::string path;
  /// Name of the map in the store; empty = as it was called.
  std::string as;
  bool force = false;
};

}  // namespace dsg::cli
