// SPDX-License-Identifier: Apache-2.0
// Which thing of the map each segment of a label image shows.
// Refuses to match across classes, and to show one thing twice in one image.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "ingest/volume/block_map.h"
#include "ingest/volume/frame_view.h"
#include "ingest/volume/voxel_meaning.h"

namespace dsg::ingest {

/// Segments vote with a grid of their pixels for the instances already in the voxels they hit; the
/// best pairs are taken first, one to one. Two instances that one segment keeps covering are
/// joined, unless they are also seen apart.
///
/// Threads: one caller at a time.
class InstanceMatcher {
 public:
  explicit InstanceMatcher(const InstanceOptions& options) : options_(options) {}

  /// Fills in `instance_of_label`: map instance of each label, 0 = none. Makes new instances.
  void Match(const FrameView& view, const BlockMap& blocks);

  /// The blocks are others than before, moved: what is known of where instances are is read anew.
  /// Pointers to blocks are void afterwards (BlockMap::Trim).
  void MoveTo(const BlockMap& blocks);

  /// 65536 numbers.
  const std::vector<uint32_t>& instance_of_label() const { return instance_of_label_; }
  const InstanceBook& book() const { return book_; }
  /// Where the names of instances have changed since the last call.
  std::vector<Box3d> TakeRenamedBoxes() { return std::exchange(renamed_boxes_, {}); }

 private:
  struct Segment {
    uint16_t label = 0;
    int samples = 0;
    int mapped = 0;
    uint32_t instance = 0;
    Box3d box;
  };
  struct Vote {
    int segment = 0;
    uint32_t instance = 0;
    int count = 0;
  };
  struct Instance {
    int64_t samples = 0;
    Box3d box;
  };

  std::vector<Vote> CollectVotes(const FrameView& view, const BlockMap& blocks);
  int SegmentOf(uint16_t label);
  void Assign(const std::vector<Vote>& votes);
  void MakeNewInstances();
  void NoteCovered(uint32_t a, uint32_t b);
  void NoteApart();
  void JoinOften();

  InstanceOptions options_;
  InstanceBook book_;
  std::vector<Instance> instances_{1};
  std::vector<Segment> segments_;
  std::vector<int> segment_of_label_;
  std::vector<uint32_t> instance_of_label_;
  // Frames in which one segment covered both instances, less those that showed them apart.
  std::map<std::pair<uint32_t, uint32_t>, int> covered_;
  std::vector<Box3d> renamed_boxes_;
};

}  // namespace dsg::ingest
