// SPDX-License-Identifier: Apache-2.0
#include "ingest/volume/instance_matcher.h"

#include <algorithm>
#include <set>
#include <tuple>

#include "absl/container/flat_hash_map.h"

namespace dsg::ingest {
namespace {

constexpr size_t kLabelCount = 65536;

class VoxelFinder {
 public:
  explicit VoxelFinder(const BlockMap& blocks) : blocks_(blocks) {}

  const VoxelLabels* LabelsAt(const Eigen::Vector3d& point_map) {
    const Eigen::Vector3i voxel = blocks_.VoxelOf(point_map);
    const BlockKey key = BlockMap::KeyOf(voxel);
    // Neighbouring pixels mostly hit the same block.
    if (!has_last_ || key != last_key_) {
      last_key_ = key;
      last_ = blocks_.Find(key);
      has_last_ = true;
    }
    return last_ == nullptr ? nullptr : last_->LabelsOf(BlockMap::IndexOf(voxel));
  }

 private:
  const BlockMap& blocks_;
  bool has_last_ = false;
  BlockKey last_key_;
  const VoxelBlock* last_ = nullptr;
};

}  // namespace

void InstanceMatcher::Match(const FrameView& view, const BlockMap& blocks) {
  segment_of_label_.resize(kLabelCount, -1);
  instance_of_label_.resize(kLabelCount, 0);
  for (const Segment& segment : segments_) {
    segment_of_label_[segment.label] = -1;
    instance_of_label_[segment.label] = 0;
  }
  segments_.clear();
  if (view.frame().labels.empty()) return;
  Assign(CollectVotes(view, blocks));
  MakeNewInstances();
  NoteApart();
  JoinOften();
  for (Segment& segment : segments_) {
    segment.instance = book_.Root(segment.instance);
    instance_of_label_[segment.label] = segment.instance;
    if (segment.instance == 0) continue;
    Instance& instance = instances_[segment.instance];
    instance.samples += segment.samples;
    instance.box.extend(segment.box);
  }
}

int InstanceMatcher::SegmentOf(uint16_t label) {
  int& number = segment_of_label_[label];
  if (number < 0) {
    number = static_cast<int>(segments_.size());
    segments_.push_back({label, 0, 0, 0, {}});
  }
  return number;
}

std::vector<InstanceMatcher::Vote> InstanceMatcher::CollectVotes(const FrameView& view,
                                                                 const BlockMap& blocks) {
  const CameraCalibration& camera = view.frame().camera;
  // Labels are kept in front of the surface rather than behind it.
  const double shift_m = 0.5 * view.band().voxel_m;
  absl::flat_hash_map<uint64_t, int> counts;
  VoxelFinder finder(blocks);
  const int stride = options_.stride_px;
  for (int row = stride / 2; row < camera.height; row += stride) {
    for (int column = stride / 2; column < camera.width; column += stride) {
      const uint16_t label = view.frame().labels[view.Offset(column, row)];
      const float depth = view.Reach(column, row);
      if ((label & 0xff) == 0 || label >> 8 == 0 || depth <= 0.0f) continue;
      const int number = SegmentOf(label);
      Segment& segment = segments_[number];
      ++segment.samples;
      const Eigen::Vector3d ray((column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy,
                                1.0);
      const Eigen::Vector3d point_map = view.frame().map_T_camera * (ray * (depth - shift_m));
      segment.box.extend(point_map);
      const VoxelLabels* labels = finder.LabelsAt(point_map);
      if (labels == nullptr) continue;
      const uint32_t instance = VoxelMeaning::InstanceOf(*labels, label >> 8, book_);
      if (instance == 0) continue;
      ++segment.mapped;
      ++counts[static_cast<uint64_t>(number) << 32 | instance];
    }
  }
  std::vector<Vote> votes;
  votes.reserve(counts.size());
  for (const auto& [key, count] : counts) {
    votes.push_back({static_cast<int>(key >> 32), static_cast<uint32_t>(key), count});
  }
  std::sort(votes.begin(), votes.end(), [](const Vote& a, const Vote& b) {
    return std::tuple(-a.count, a.segment, a.instance) <
           std::tuple(-b.count, b.segment, b.instance);
  });
  return votes;
}

void InstanceMatcher::Assign(const std::vector<Vote>& votes) {
  std::set<uint32_t> taken;
  std::vector<Vote> further;
  for (const Vote& vote : votes) {
    Segment& segment = segments_[vote.segment];
    if (vote.count < options_.vote_count_min ||
        vote.count < options_.share_of_samples * segment.samples ||
        vote.count < options_.share_of_mapped * segment.mapped) {
      continue;
    }
    if (segment.instance != 0) {
      further.push_back(vote);
    } else if (taken.insert(vote.instance).second) {
      segment.instance = vote.instance;
    }
  }
  for (const Vote& vote : further) {
    if (taken.count(vote.instance) == 0) {
      NoteCovered(segments_[vote.segment].instance, vote.instance);
    }
  }
}

void InstanceMatcher::MakeNewInstances() {
  for (Segment& segment : segments_) {
    if (segment.instance != 0 || segment.samples < options_.sample_count_min) continue;
    segment.instance = book_.Add(segment.label >> 8);
    if (segment.instance != 0) instances_.emplace_back();
  }
}

void InstanceMatcher::NoteCovered(uint32_t a, uint32_t b) {
  ++covered_[{std::min(a, b), std::max(a, b)}];
}

void InstanceMatcher::NoteApart() {
  std::set<uint32_t> shown;
  for (const Segment& segment : segments_) shown.insert(segment.instance);
  for (auto& [pair, frames] : covered_) {
    if (shown.count(pair.first) > 0 && shown.count(pair.second) > 0)
      frames -= options_.apart_frame_count;
  }
}

void InstanceMatcher::JoinOften() {
  for (auto at = covered_.begin(); at != covered_.end();) {
    const uint32_t a = book_.Root(at->first.first);
    const uint32_t b = book_.Root(at->first.second);
    const bool is_stale = at->first != std::pair(a, b) || a == b;
    if (!is_stale && at->second < options_.join_frame_count) {
      ++at;
      continue;
    }
    at = covered_.erase(at);
    if (is_stale) continue;
    const bool keeps_a = instances_[a].samples >= instances_[b].samples;
    const uint32_t winner = keeps_a ? a : b;
    const uint32_t loser = keeps_a ? b : a;
    book_.Join(winner, loser);
    renamed_boxes_.push_back(instances_[loser].box);
    instances_[winner].samples += instances_[loser].samples;
    instances_[winner].box.extend(instances_[loser].box);
  }
}

void InstanceMatcher::MoveTo(const BlockMap& blocks) {
  for (Instance& instance : instances_) instance.box.setEmpty();
  for (int64_t number = 0; number < blocks.size(); ++number) {
    // Errors stay in the map.
    if (blocks.IsFull()) blocks.Trim().IgnoreError();
    const VoxelBlock& block = blocks.block(number);
    for (int i = 0; i < VoxelBlock::kCount; ++i) {
      const VoxelLabels* labels = block.LabelsOf(i);
      const uint32_t id = labels == nullptr ? 0 : book_.Root(labels->instances.Best());
      if (id == 0) continue;
      const Eigen::Vector3i voxel(
          VoxelBlock::kSide * block.key.x + i % VoxelBlock::kSide,
          VoxelBlock::kSide * block.key.y + i / VoxelBlock::kSide % VoxelBlock::kSide,
          VoxelBlock::kSide * block.key.z + i / (VoxelBlock::kSide * VoxelBlock::kSide));
      instances_[id].box.extend((voxel.cast<double>().array() + 0.5).matrix() * blocks.voxel_m());
    }
  }
}

}  // namespace dsg::ingest
