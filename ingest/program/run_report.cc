// SPDX-License-Identifier: Apache-2.0
#include "ingest/program/run_report.h"

#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "ingest/program/yield.h"
#include "schema/base/counted.h"
#include "schema/base/printable.h"
#include "schema/program/command_line.h"

namespace dsg::ingest {
namespace {

using Json = nlohmann::ordered_json;

// "320 images (cam0 160, cam1 160), 1791 inertial samples".
std::string UnusedText(const IngestSummary& summary) {
  int64_t image_count = 0;
  std::vector<std::string> cameras;
  std::vector<std::string> parts;
  for (const auto& [channel, count] : summary.unused) {
    if (channel == "imu0") {
      parts.push_back(absl::StrCat(count, " inertial samples"));
    } else if (channel == "detections0") {
      parts.push_back(absl::StrCat(count, " detections"));
    } else {
      image_count += count;
      cameras.push_back(absl::StrCat(channel, " ", count));
    }
  }
  if (image_count > 0) {
    parts.push_back(absl::StrCat(image_count, " images (", absl::StrJoin(cameras, ", "), ")"));
  }
  return absl::StrJoin(parts, ", ");
}

void PrintSummary(const std::string& path, const LogInfo& info, const IngestSummary& summary,
                  double seconds) {
  const CommitCounts& counts = summary.committed;
  const std::vector<std::string> parts = {
      Counted(summary.agent_count, "agent"), Counted(counts.pose_count, "pose"),
      Counted(counts.node_count, "node"), Counted(counts.edge_count, "edge"),
      Counted(counts.stay_count, "stay")};
  std::printf("%s (%s): %s in %s; %s skipped; %.1f s\n", path.c_str(), info.format.c_str(),
              absl::StrJoin(parts, ", ").c_str(),
              Counted(counts.revision_count, "revision").c_str(),
              Counted(counts.skipped_pose_count, "pose").c_str(), seconds);
  if (counts.revision_count == 0) std::printf("%s: nothing new\n", path.c_str());
  if (!summary.unused.empty()) {
    std::printf("%s: read and not used yet: %s\n", path.c_str(), UnusedText(summary).c_str());
  }
}

void PrintLoops(const std::string& path, const LoopCounts& loops) {
  const std::string repeated =
      loops.repeated_count == 0
          ? ""
          : absl::StrCat(", ", loops.repeated_count, " that say again what others say (left out)");
  std::printf(
      "%s: %lld loop closures, %lld believed, %lld outside the trajectory%s; it moved by up to "
      "%.2f m\n",
      path.c_str(), static_cast<long long>(loops.loop_count),
      static_cast<long long>(loops.kept_count), static_cast<long long>(loops.unusable_count),
      repeated.c_str(), loops.largest_m);
  constexpr size_t kNamedMax = 10;
  std::vector<std::string> named(loops.doubted);
  if (named.size() > kNamedMax) {
    named.resize(kNamedMax);
    named.push_back(absl::StrCat("and ", loops.doubted.size() - kNamedMax, " more"));
  }
  if (!named.empty()) {
    std::printf("%s: not believed: %s\n", path.c_str(), absl::StrJoin(named, ", ").c_str());
  }
}

void PrintStages(const std::map<std::string, StageClock::Time>& stages) {
  for (const auto& [stage, time] : stages) {
    std::printf("%-12s %8lld %10.2f %12.2f %12.2f\n", stage.c_str(),
                static_cast<long long>(time.count), time.total_s,
                1e3 * time.total_s / static_cast<double>(time.count), 1e3 * time.longest_s);
  }
}

void PrintMapping(const std::string& path, const MappingSummary& summary, bool has_timings) {
  const VolumeCounts& volume = summary.volume;
  std::printf("%s: %lld frames fused, %lld pixels, %lld of them people", path.c_str(),
              static_cast<long long>(volume.frame_count),
              static_cast<long long>(volume.pixel_count + volume.dynamic_pixel_count),
              static_cast<long long>(volume.dynamic_pixel_count));
  if (!summary.skipped.empty()) std::printf("; skipped: %s", CountsText(summary.skipped).c_str());
  if (volume.refused_block_count > 0) {
    std::printf("; %lld blocks of space left out, the map is too large for its voxels",
                static_cast<long long>(volume.refused_block_count));
  }
  if (volume.cut_block_count > 0) {
    std::printf("; %lld blocks too far from the others for places and rooms",
                static_cast<long long>(volume.cut_block_count));
  }
  std::printf("\n");
  if (!summary.note.empty()) {
    TellNote(path, summary.note);
  }
  if (volume.pixel_count == 0) {
    std::fprintf(stderr,
                 "%s: warning: nothing was mapped: no frame had depth that could be used; look at "
                 "what was skipped, at the depth images and at the time stamps of the poses\n",
                 path.c_str());
  }
  if (has_timings) {
    std::printf("%-12s %8s %10s %12s %12s\n", "stage", "times", "total s", "mean ms", "longest ms");
    PrintStages(summary.stages);
  }
}

void PrintPeople(const std::string& path, const PeopleSummary& summary, bool has_timings) {
  const PeopleCounts& counts = summary.counts;
  std::printf("%s: %lld of %lld detections of people used, %lld tracks", path.c_str(),
              static_cast<long long>(counts.used_count),
              static_cast<long long>(counts.detection_count),
              static_cast<long long>(counts.track_count));
  if (counts.dropped_track_count > 0) {
    std::printf(" and %lld too short to believe",
                static_cast<long long>(counts.dropped_track_count));
  }
  if (counts.same_as_count > 0) {
    std::printf(", %lld of them perhaps the same person",
                static_cast<long long>(counts.same_as_count));
  }
  if (!counts.rejected.empty()) std::printf("; left out: %s", CountsText(counts.rejected).c_str());
  std::printf("\n");
  if (counts.body_count > 0) {
    std::printf("%s: %lld of them with vertices of the body", path.c_str(),
                static_cast<long long>(counts.body_count));
    if (counts.faceless_body_count > 0) {
      std::printf(", %lld without faces that fit: stored as points",
                  static_cast<long long>(counts.faceless_body_count));
    }
    std::printf("\n");
  }
  if (has_timings) PrintStages(summary.stages);
}

Json StagesJson(const std::map<std::string, StageClock::Time>& stages) {
  Json json = Json::object();
  for (const auto& [stage, time] : stages) {
    json[stage] = {{"times", time.count}, {"total_s", time.total_s}, {"longest_s", time.longest_s}};
  }
  return json;
}

Json MappingJson(const MappingSummary& mapping) {
  const VolumeCounts& volume = mapping.volume;
  return {{"frames", volume.frame_count},
          {"pixels", volume.pixel_count},
          {"pixels_of_people", volume.dynamic_pixel_count},
          {"skipped", Json(mapping.skipped)},
          {"blocks", volume.block_count},
          {"blocks_in_memory", volume.resident_block_count},
          {"blocks_left_out", volume.refused_block_count},
          {"blocks_too_far", volume.cut_block_count}};
}

Json PeopleJson(const PeopleCounts& counts) {
  return {{"detections", counts.detection_count},
          {"used", counts.used_count},
          {"bodies", counts.body_count},
          {"bodies_without_faces", counts.faceless_body_count},
          {"left_out", Json(counts.rejected)},
          {"tracks", counts.track_count},
          {"tracks_too_short", counts.dropped_track_count},
          {"perhaps_the_same", counts.same_as_count}};
}

Json LoopsJson(const LoopCounts& loops) {
  return {{"loops", loops.loop_count},
          {"believed", loops.kept_count},
          {"outside_the_trajectory", loops.unusable_count},
          {"repeated", loops.repeated_count},
          {"moved_m", loops.largest_m},
          {"not_believed", loops.doubted}};
}

std::string NoteOfName(const std::string& name, NodeId id) {
  return absl::StrCat("agent \"", name, "\" of the log has the id ", ToString(id),
                      ": ask for that, since \"", name, "\" is read as an id");
}

// Of the log, and of what became of it.
std::vector<std::string> NotesOf(const RunReport& report) {
  std::vector<std::string> notes = report.info.notes;
  for (const auto& [name, id] : report.summary.misleading_names) {
    notes.push_back(NoteOfName(name, id));
  }
  return notes;
}

}  // namespace

void PrintReport(const RunReport& report, bool has_timings) {
  const IngestSummary& summary = report.summary;
  const std::string path = Printable(report.path);
  PrintSummary(path, report.info, summary, report.seconds);
  for (const auto& [name, id] : summary.misleading_names) {
    TellNote(path, NoteOfName(name, id));
  }
  if (summary.loops.has_value()) PrintLoops(path, *summary.loops);
  if (summary.mapping.has_value()) PrintMapping(path, *summary.mapping, has_timings);
  if (summary.people.has_value()) {
    PrintPeople(path, *summary.people, has_timings);
    if (report.info.body_topology != nullptr && summary.people->counts.body_count == 0) {
      TellNote(path, "the log has faces of bodies, but no detection has vertices");
    }
  }
  if (report.is_dry_run) {
    std::printf("%s: nothing was written: this was a dry run\n", path.c_str());
  }
  std::fflush(stdout);
}

std::string ReportJson(const RunReport& report) {
  const IngestSummary& summary = report.summary;
  const CommitCounts& counts = summary.committed;
  Json json = {{"log", report.path},
               {"format", report.info.format},
               {"dry_run", report.is_dry_run},
               {"agents", summary.agent_count},
               {"poses", counts.pose_count},
               {"poses_skipped", counts.skipped_pose_count},
               {"nodes", counts.node_count},
               {"edges", counts.edge_count},
               {"stays", counts.stay_count},
               {"revisions", counts.revision_count},
               {"last_revision", counts.last_revision},
               {"unused", Json(summary.unused)},
               {"notes", Json(NotesOf(report))},
               {"seconds", report.seconds}};
  if (summary.mapping.has_value()) {
    json["mapping"] = MappingJson(*summary.mapping);
    json["stages"] = StagesJson(summary.mapping->stages);
  }
  if (summary.people.has_value()) json["people"] = PeopleJson(summary.people->counts);
  if (summary.loops.has_value()) json["loops"] = LoopsJson(*summary.loops);
  // Names of files may be no UTF-8.
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace dsg::ingest
