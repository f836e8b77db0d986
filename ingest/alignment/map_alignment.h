// SPDX-License-Identifier: Apache-2.0
// Where one map is in another one, from the places that robots of both remember.
// Refuses to write anything: a merge does (schema/merge).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/recognition/recognition_options.h"
#include "ingest/recognition/session_alignment.h"
#include "schema/store/snapshot.h"

namespace dsg::ingest {

struct MapAlignmentOptions {
  PlaceIndexOptions index;
  PlaceVerifierOptions verifier;
  SessionAlignmentOptions sessions;

  std::vector<BoundOption> Bind();
};

struct MapAlignment {
  SessionAlignment found;
  /// Keyframes that are remembered.
  int keyframe_count = 0;
  int other_keyframe_count = 0;
};

/// How a map is called in messages.
struct NamedMap {
  std::string name;
  const Snapshot* map = nullptr;
};

/// Seeks each place that a robot of `other` remembers among those of `into`, verifies what looks
/// like it, and takes the transform that most of these views agree with (AlignSessions). Where the
/// robots were is read from their tracks as they are now, corrected or not.
///
/// `on_work` (may be empty): keyframes that were sought so far, and all.
/// Errors: NOT_FOUND/NO_REGISTRATION where a map remembers nothing, or the views do not agree,
/// saying how many there are; of the store; DATA_LOSS/STORE_CORRUPT for damaged memories.
/// Cost: 5 to 40 ms a keyframe of `other`.
absl::StatusOr<MapAlignment> AlignMaps(const NamedMap& into, const NamedMap& other,
                                       const MapAlignmentOptions& options,
                                       const std::function<void(int64_t, int64_t)>& on_work);

}  // namespace dsg::ingest
