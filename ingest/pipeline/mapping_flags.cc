// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/mapping_flags.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

absl::StatusOr<TimeNs> Nanoseconds(const char* flag, double seconds) {
  // A day is past any use, and in range of the type.
  if (seconds >= 0.1 && seconds <= 86400.0) {
    return std::llround(seconds * static_cast<double>(kNsPerSecond));
  }
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("--", flag, " is ", seconds, "; give 0.1 to 86400 seconds"),
                   {{"field", flag}, {"value", absl::StrCat(seconds)}});
}

}  // namespace

void AddMappingFlags(CLI::App* app, MappingFlags* flags) {
  const std::string group = "Static layers (logs with depth)";
  app->add_flag("--no-layers", flags->is_off, "Poses only: no mesh, objects, places and rooms")
      ->group(group);
  app->add_option("--voxel", flags->voxel_m, "Edge of a voxel, metres")
      ->capture_default_str()
      ->group(group);
  app->add_option("--range", flags->range_m, "How far depth is trusted, metres")
      ->capture_default_str()
      ->group(group);
  app->add_option("--masking", flags->masking,
                  "Pixels of people: carve (free space up to them), drop, or off (part of the "
                  "building)")
      ->check(CLI::IsMember({"carve", "drop", "off"}))
      ->capture_default_str()
      ->group(group);
  app->add_option("--cad", flags->cad_folder, "Folder of CAD models (PLY, OBJ) of known shapes")
      ->group(group);
  app->add_option("--rooms", flags->rooms,
                  "How rooms are told apart: ceiling (section below it), clearance (narrow ways of "
                  "free space), filtration (of the graph of places), or auto")
      ->check(CLI::IsMember({"auto", "ceiling", "clearance", "filtration"}))
      ->capture_default_str()
      ->group(group);
  app->add_option("--places", flags->places, "Places on the ground, or in the whole volume")
      ->check(CLI::IsMember({"ground", "volume"}))
      ->capture_default_str()
      ->group(group);
  app->add_option("--robot-radius", flags->robot_radius_m, "What ways must be clear of, metres")
      ->capture_default_str()
      ->group(group);
  app->add_option("--commit-seconds", flags->commit_s, "Log time between commits")
      ->capture_default_str()
      ->group(group);
  app->add_option("--mesh-seconds", flags->mesh_s,
                  "Log time that a change of the mesh waits for its commit at most, 2 to 3600")
      ->capture_default_str()
      ->group(group);
  app->add_option("--layers-seconds", flags->layers_s,
                  "Least log time between updates of objects, places and rooms")
      ->capture_default_str()
      ->group(group);
  app->add_option("--threads", flags->thread_count, "Threads of the fusion")
      ->check(CLI::Range(1, 64))
      ->capture_default_str()
      ->group(group);
  app->add_flag("--timings", flags->has_timings, "Print what each stage has cost")->group(group);
}

absl::StatusOr<MappingOptions> MakeMappingOptions(const MappingFlags& flags) {
  MappingOptions options;
  options.is_on = !flags.is_off;
  options.volume.voxel_m = flags.voxel_m;
  options.volume.range_m = flags.range_m;
  options.volume.thread_count = flags.thread_count;
  if (flags.masking == "drop") options.volume.masking = DynamicMasking::kDrop;
  if (flags.masking == "off") options.volume.masking = DynamicMasking::kOff;
  if (flags.rooms == "ceiling") options.rooms.method = RoomMethod::kCeiling;
  if (flags.rooms == "filtration") options.rooms.method = RoomMethod::kFiltration;
  if (flags.rooms == "clearance") options.rooms.method = RoomMethod::kClearance;
  if (flags.places == "volume") options.places.mode = PlaceMode::kVolume;
  options.places.robot_radius_m = flags.robot_radius_m;
  DSG_ASSIGN_OR_RETURN(options.commit_period_ns, Nanoseconds("commit-seconds", flags.commit_s));
  DSG_ASSIGN_OR_RETURN(options.mesh_wait_max_ns, Nanoseconds("mesh-seconds", flags.mesh_s));
  DSG_ASSIGN_OR_RETURN(options.layers_period_ns, Nanoseconds("layers-seconds", flags.layers_s));
  DSG_RETURN_IF_ERROR(options.Validate());
  if (!flags.cad_folder.empty()) {
    DSG_ASSIGN_OR_RETURN(options.catalogue, ReadCatalogue(flags.cad_folder));
  }
  return options;
}

void PrintMapping(const std::string& path, const MappingSummary& summary, bool has_timings) {
  const VolumeCounts& volume = summary.volume;
  std::printf("%s: %lld frames fused, %lld pixels, %lld of them people", path.c_str(),
              static_cast<long long>(volume.frame_count),
              static_cast<long long>(volume.pixel_count + volume.dynamic_pixel_count),
              static_cast<long long>(volume.dynamic_pixel_count));
  std::vector<std::string> skipped;
  for (const auto& [reason, count] : summary.skipped) {
    skipped.push_back(absl::StrCat(reason, " ", count));
  }
  if (!skipped.empty()) std::printf("; skipped: %s", absl::StrJoin(skipped, ", ").c_str());
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
    std::fprintf(stderr, "%s: note: %s\n", path.c_str(), summary.note.c_str());
  }
  if (volume.pixel_count == 0) {
    std::fprintf(stderr,
                 "%s: warning: nothing was mapped: no frame had depth that could be used; look at "
                 "what was skipped, at the depth images and at the time stamps of the poses\n",
                 path.c_str());
  }
  if (has_timings) {
    std::printf("%-12s %8s %10s %12s %12s\n", "stage", "times", "total s", "mean ms", "longest ms");
    for (const auto& [stage, time] : summary.stages) {
      std::printf("%-12s %8lld %10.2f %12.2f %12.2f\n", stage.c_str(),
                  static_cast<long long>(time.count), time.total_s,
                  1e3 * time.total_s / static_cast<double>(time.count), 1e3 * time.longest_s);
    }
  }
  std::fflush(stdout);
}

}  // namespace dsg::ingest
