// SPDX-License-Identifier: Apache-2.0
// Which keyframes of the past look like a new one: an index of binary descriptors that needs no
// vocabulary, of all tracks together.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/recognition/keyframe_features.h"
#include "ingest/recognition/recognition_options.h"

namespace dsg::ingest {

/// The best keyframe of an island: neighbours in time that look like the query.
struct PlaceCandidate {
  std::shared_ptr<const KeyframeFeatures> keyframe;
  /// Features of the query that it looks like, of PlaceIndexOptions::feature_count_max.
  int vote_count = 0;
  /// These, weighted by how few keyframes each of them looks like, as a share of all that
  /// vote: 0 to 1.
  double score = 0.0;
  /// Queries of the track in a row that have found this island, with this one.
  int query_count = 1;
};

/// Each descriptor is entered sixteen times, by each of its sixteen parts of sixteen bits. A query
/// compares its descriptors with those that share a part: one that differs in 30 of 256 bits at
/// random is found with chance 0.92, in 50 with 0.48, which is enough for votes. Each feature votes
/// once for each keyframe that has one alike.
///
/// When it is full, every second keyframe of each track is forgotten, and from then on only every
/// second one is entered, and so on: a long path is remembered more thinly, and alike everywhere.
///
/// Memory: 56 bytes a feature, 64 more for each that votes, and 25 MB; 400 MB with the bounds of
/// the defaults, when full. Cost of a query on one busy core: 3 ms with 100 keyframes, 15 with
/// 1,000, 26 with 3,000, and 1 ms to enter one. Results depend on the order of calls alone.
/// Threads: one caller at a time. Source: Norouzi, Punjani and Fleet, "Fast search in Hamming space
/// with multi-index hashing", CVPR 2012; Galvez-Lopez and Tardos, "Bags of binary words", T-RO 2012
/// (islands, consistency).
class PlaceIndex {
 public:
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID for options out of their ranges.
  static absl::StatusOr<PlaceIndex> Make(const PlaceIndexOptions& options = {});
  ~PlaceIndex();
  PlaceIndex(PlaceIndex&&) noexcept;
  PlaceIndex& operator=(PlaceIndex&&) noexcept;

  /// Islands that look like `query`, best first, then the earlier track and time; without recent
  /// keyframes of its own track. Remembers them for PlaceCandidate::query_count of the next query
  /// of this track. The query itself is not entered.
  std::vector<PlaceCandidate> Query(const KeyframeFeatures& query);

  /// False if it is passed over, because the index has become thin. Features are to be in
  /// the order of their strength, as KeyframeFeatureFinder has them: the first ones vote.
  bool Add(std::shared_ptr<const KeyframeFeatures> keyframe);

  /// Keyframes that are remembered.
  int size() const;

 private:
  class Impl;
  explicit PlaceIndex(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::ingest
