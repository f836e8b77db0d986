// SPDX-License-Identifier: Apache-2.0
// A map of a real store that grows by random deltas: places as in RandomWorld, with classes and
// names, and objects in rooms and places that come, change and go.
#pragma once

#include <memory>
#include <string>

#include "schema/store/graph_store.h"
#include "tests/support/random_world.h"
#include "tests/support/temp_folder.h"

namespace dsg::test {

class ChangingMap {
 public:
  explicit ChangingMap(uint64_t seed);

  /// Commits a random delta; returns the new revision.
  Revision Grow();
  /// Commits poses only.
  Revision GrowTracksOnly();
  Revision Commit(GraphDelta delta);

  const std::shared_ptr<MapReader>& reader() const { return reader_; }
  std::shared_ptr<const Snapshot> At(Revision revision) const;
  RandomWorld& random() { return random_; }

 private:
  void Decorate(GraphDelta* delta);
  void ChangeObjects(GraphDelta* delta);

  TempFolder folder_;
  RandomWorld random_;
  NaiveMap naive_;
  std::unique_ptr<GraphStore> store_;
  std::unique_ptr<GraphWriter> writer_;
  std::shared_ptr<MapReader> reader_;
  uint64_t next_object_ = 1;
  bool has_first_ = false;
};

}  // namespace dsg::test
