// SPDX-License-Identifier: Apache-2.0
// A random map with its history twice: behind a ServiceCore and as naive maps, so that the answers
// of the one can be held against plain scans of the other. Refuses to answer questions itself.
#pragma once

#include <memory>
#include <vector>

#include "query/service/service_core.h"
#include "schema/base/random.h"
#include "tests/support/random_world.h"
#include "tests/support/temp_folder.h"

namespace dsg::test {

/// How the deltas of a world get into the store.
enum class Writing {
  kPlain,
  /// Rows shuffled, deltas cut into small ones: the same beliefs, another order of insertion.
  kShuffledAndSplit,
};

/// The world of RandomWorld with a building, structures, furniture, more places and links.
class QuestionWorld {
 public:
  static constexpr char kMap[] = "world";
  static constexpr int kRevisionCount = 12;

  QuestionWorld(uint64_t seed, TrajectoryCodec codec, Writing writing);

  Revision head() const { return kRevisionCount; }
  const NaiveMap& At(Revision revision) const { return history_[static_cast<size_t>(revision)]; }
  /// 1 to the head, the head a third of the time.
  Revision AnyRevision(Random* random) const;
  /// The store's number for a revision of the history.
  Revision StoredRevision(Revision revision) const {
    return stored_[static_cast<size_t>(revision)];
  }
  bool is_lossless() const { return is_lossless_; }
  query::ServiceCore* core() const { return core_.get(); }

 private:
  void Write(GraphDelta delta, GraphWriter* writer, Random* random, int64_t* sequence);

  const bool is_lossless_;
  const Writing writing_;
  TempFolder folder_;
  std::vector<NaiveMap> history_;
  std::vector<Revision> stored_;
  std::unique_ptr<query::ServiceCore> core_;
};

}  // namespace dsg::test
