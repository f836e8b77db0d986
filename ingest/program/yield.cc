// SPDX-License-Identifier: Apache-2.0
#include "ingest/program/yield.h"

#include <array>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

struct Remedy {
  const char* reason;
  const char* what;
};

// In the order of their reasons; see SkipCounts.
constexpr std::array<Remedy, 5> kRemedies = {{
    {"no depth image",
     "the log has pictures and no depth; name its depth images, or take its poses alone with "
     "--no-layers"},
    {"no pose",
     "frames need a pose before and one after them, at most 0.5 s apart, on the same clock: give "
     "denser poses with --pose-file, or choose others with --poses"},
    {"no right image",
     "stereo needs the pictures of both cameras with the same stamps (within 2 ms); look at the "
     "stamps of cam0 and cam1"},
    {"pose jump",
     "consecutive poses are further apart than 20 m/s or 20 rad/s allow, so that nobody knows "
     "where the camera was: give poses without jumps with --pose-file, or choose the log's other "
     "ones with --poses gt or --poses external; look at the unit of the stamps (ns) if every pose "
     "jumps"},
    {"size differs from calibration",
     "the images are of another size than their calibration says; correct width and height there"},
}};

// Reasons that take a frame, and not only its colours or labels, or a pose.
bool IsOfFrame(const std::string& reason) {
  return !absl::StrContains(reason, "left out") && reason != "broken pose";
}

absl::Status NothingError(const LogInfo& info, const std::string& why) {
  return absl::FailedPreconditionError(
      absl::StrCat(info.path, " (", info.format, ") gives the map nothing: ", why));
}

std::string WhyEmpty(const IngestSummary& summary) {
  if (summary.unused.empty()) {
    return "it has no poses and no nodes; look at the file, and at the --format it was read as";
  }
  return absl::StrCat(
      "it has measurements (", CountsText(summary.unused),
      ") and no poses; let these be estimated from images with --poses vio, or give "
      "--pose-file FILE with EuRoC or TUM columns");
}

// Empty if a frame was used, or there was none.
std::string WhyUnmapped(const IngestSummary& summary) {
  if (!summary.mapping.has_value()) return "";
  const VolumeCounts& volume = summary.mapping->volume;
  if (volume.pixel_count + volume.dynamic_pixel_count > 0) return "";
  SkipCounts lost;
  for (const auto& [reason, count] : summary.mapping->skipped) {
    if (IsOfFrame(reason)) lost[reason] = count;
  }
  if (volume.frame_count > 0) lost["without a pixel of usable depth"] = volume.frame_count;
  if (lost.empty()) return "";
  std::string why = absl::StrCat("all its frames are lost (", CountsText(lost), ")");
  for (const std::string& hint : HintsOnLostFrames(lost)) absl::StrAppend(&why, "; ", hint);
  return absl::StrCat(why, "; --no-layers takes the poses alone");
}

}  // namespace

std::string CountsText(const std::map<std::string, int64_t>& counts) {
  std::vector<std::string> parts;
  for (const auto& [what, count] : counts) parts.push_back(absl::StrCat(what, " ", count));
  return absl::StrJoin(parts, ", ");
}

absl::Status CheckYield(const LogInfo& info, const IngestSummary& summary) {
  const CommitCounts& counts = summary.committed;
  const bool has_content = summary.given_count > 0 || summary.agent_count > 0 ||
                           counts.revision_count > 0 || summary.was_known;
  if (!has_content) return NothingError(info, WhyEmpty(summary));
  // People that were seen are something, whatever became of the frames.
  if (summary.agent_count > 1) return absl::OkStatus();
  const std::string why = WhyUnmapped(summary);
  return why.empty() ? absl::OkStatus() : NothingError(info, why);
}

std::vector<std::string> HintsOnLostFrames(const SkipCounts& skipped) {
  std::vector<std::string> hints;
  for (const Remedy& remedy : kRemedies) {
    const auto found = skipped.find(remedy.reason);
    if (found == skipped.end() || found->second == 0) continue;
    hints.push_back(absl::StrCat(remedy.reason, ": ", remedy.what));
  }
  return hints;
}

}  // namespace dsg::ingest
