// SPDX-License-Identifier: Apache-2.0
// A store with two maps, copied for each kill, and what must hold of it afterwards.
// Refuses to repair anything: a check gives one sentence about what is wrong.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "schema/store/graph_store.h"
#include "tests/support/temp_folder.h"

namespace dsg::test {

/// What a map says at its readable revisions, as text.
struct MapContent {
  /// nullopt-like: no revision at all means that there is no such map.
  Revision oldest = 0;
  Revision newest = 0;
  std::map<std::string, Revision> tags;
  /// Without the counters of the file.
  std::map<Revision, std::string> dumps;
  std::map<Revision, std::string> digests;
};

/// Opens the map read-only, checks all of it and reads `revisions` (those that can be read).
/// Problems that Verify finds are appended to `problems`.
MapContent ReadContent(const std::string& store, const std::string& map,
                       const std::vector<Revision>& revisions, std::string* problems);

/// The store that every kill begins with, made once.
///
/// Threads: one caller at a time.
class KeepRig {
 public:
  static constexpr char kMain[] = "office";
  static constexpr char kOther[] = "annex";
  static constexpr char kTag[] = "kept";
  static constexpr Revision kLength = 36;
  static constexpr Revision kTagged = 9;
  static constexpr Revision kKeepFrom = 24;

  KeepRig();

  const std::string& folder() const { return folder_.path(); }
  const std::string& store() const { return store_; }
  /// Of the main map, at kTagged, kKeepFrom and kLength.
  const MapContent& content() const { return content_; }
  const MapContent& other_content() const { return other_content_; }
  /// A folder with a copy of the store, "<folder>/store".
  std::string MakePlace();
  /// The same with a map of format 1 instead.
  std::string MakeOldPlace();
  /// A log for dsg-ingest.
  std::string log_path() const { return folder_.path() + "/people.txt"; }
  /// Revisions that are looked at.
  static std::vector<Revision> Looked() { return {kTagged, kKeepFrom, kLength}; }

 private:
  TempFolder folder_;
  std::string store_;
  MapContent content_;
  MapContent other_content_;
  int place_count_ = 0;
};

}  // namespace dsg::test
