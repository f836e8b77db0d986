// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/followed_transforms.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/followed_log.h"
#include "schema/base/status.h"

namespace dsg::ingest {

absl::StatusOr<std::optional<FollowedTransforms>> FollowedTransforms::Make(TransformTree begin) {
  DSG_ASSIGN_OR_RETURN(std::optional<BodyTrack> track,
                       begin.MakeTrack(TransformTree::Tracks::kAnyDynamic, kTransformWaitingMax));
  if (!track.has_value()) return std::nullopt;
  return FollowedTransforms(std::move(begin), *std::move(track));
}

FollowedTransforms::FollowedTransforms(TransformTree tree, BodyTrack track)
    : tree_(std::move(tree)), track_(std::move(track)) {
  for (const ChainFrame& frame : track_.chain()) parent_of_[frame.name] = frame.parent;
}

absl::Status FollowedTransforms::Take(const RosBytes& message, const std::string& origin) {
  DSG_ASSIGN_OR_RETURN(const std::vector<RosPose> transforms, ParseRosTransforms(message, origin));
  for (const RosPose& transform : transforms) {
    DSG_RETURN_IF_ERROR(tree_.Add(transform, origin));
    DSG_RETURN_IF_ERROR(CheckChain(transform));
    DSG_RETURN_IF_ERROR(track_.Add(transform, origin));
  }
  return absl::OkStatus();
}

// A frame of the chain stays where it is in the chain, and the root is in no other frame.
absl::Status FollowedTransforms::CheckChain(const RosPose& transform) {
  const auto known = parent_of_.find(FrameName(transform.child_frame_id));
  const std::string parent = FrameName(transform.header.frame_id);
  if (known == parent_of_.end() || known->second == parent) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const std::vector<std::string> chain,
                       tree_.ChainFrom(track_.chain().front().name));
  // A longer one; a transform that was no pose has changed nothing.
  if (chain.size() > track_.chain().size()) late_root_ = parent;
  return absl::OkStatus();
}

std::optional<BodyPose> FollowedTransforms::Next(TimeNs now_ns) {
  const TimeNs overdue_ns = now_ns - kTransformWaitNs;
  if (const std::optional<BodyPose> pose = track_.Next(overdue_ns)) return pose;
  track_.SkipBefore(overdue_ns);
  return track_.Next(overdue_ns);
}

bool FollowedTransforms::IsSettled(TimeNs time_ns, TimeNs now_ns, size_t waiting_count) const {
  return time_ns <= track_.known_ns() || now_ns - time_ns >= kTransformWaitNs ||
         waiting_count >= kTransformWaitingMax;
}

void FollowedTransforms::AddNotes(std::vector<std::string>* notes) const {
  NotePassedOver(track_.passed_over_count(), notes);
  if (track_.skipped_count() > 0) {
    notes->push_back(absl::StrCat(track_.skipped_count(),
                                  " poses of /tf are left out: the transforms above them did not "
                                  "come within ",
                                  kTransformWaitNs / kNsPerSecond, " s, or ", kTransformWaitingMax,
                                  " poses"));
  }
  if (track_.late_count() > 0) {
    notes->push_back(absl::StrCat(track_.late_count(),
                                  " poses of /tf are left out: they came when other topics were "
                                  "later by ",
                                  kTransformWaitNs / kNsPerSecond, " s; do they share a clock?"));
  }
  if (track_.waiting_count() > 0) {
    notes->push_back(absl::StrCat(track_.waiting_count(),
                                  " poses of /tf at the end are not read: they wait for transforms "
                                  "above them"));
  }
  if (!late_root_.empty()) notes->push_back(LateRootNote());
}

std::string FollowedTransforms::LateRootNote() const {
  if (late_root_.empty()) return "";
  const std::string root = ShownFrame(track_.chain().back().name);
  return absl::StrCat("frame ", root, " came to be in ", ShownFrame(late_root_), " later than ",
                      kFollowedBeginNs / kNsPerSecond,
                      " s after the first message: the robot's poses stay those in ", root);
}

}  // namespace dsg::ingest
