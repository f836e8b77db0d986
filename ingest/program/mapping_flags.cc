// SPDX-License-Identifier: Apache-2.0
#include "ingest/program/mapping_flags.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <vector>

#include "absl/strings/str_cat.h"
#include "ingest/config/option_flags.h"
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
                  "free space), filtration (of the graph of places), paper (pieces of the distance "
                  "field below the ceiling, and nothing else), or auto")
      ->check(CLI::IsMember({"auto", "ceiling", "clearance", "filtration", "paper"}))
      ->capture_default_str()
      ->group(group);
  app->add_flag("--whole-corridors", flags->keeps_corridors,
                "A net of corridors is one room; otherwise each of its straight arms is")
      ->group(group);
  app->add_option("--objects", flags->objects,
                  "What one object is: instances (by labels, pictures and floors), or paper "
                  "(clusters of the mesh of a class; CAD models wherever corners say)")
      ->check(CLI::IsMember({"instances", "paper"}))
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
  app->add_flag("--fuse-once", flags->is_fused_once,
                "Leave surfaces as corrections have moved them; otherwise a log with loop closures "
                "is read and fused once more when it has ended")
      ->group(group);
  app->add_option("--threads", flags->thread_count, "Threads of the fusion")
      ->check(CLI::Range(1, 64))
      ->capture_default_str()
      ->group(group);
  app->add_flag("--timings", flags->has_timings, "Print what each stage has cost")->group(group);
  AddTuning(flags->numbers.Groups(), app);
  const OptionGroup memory{"memory", flags->numbers.volume.spill.Bind()};
  AddTuning({&memory, 1}, app);
}

absl::StatusOr<MappingOptions> MakeMappingOptions(const MappingFlags& flags) {
  MappingOptions options = flags.numbers;
  options.is_on = !flags.is_off;
  options.fuses_again = !flags.is_fused_once;
  options.volume.voxel_m = flags.voxel_m;
  options.volume.range_m = flags.range_m;
  options.volume.thread_count = flags.thread_count;
  if (flags.masking == "drop") options.volume.masking = DynamicMasking::kDrop;
  if (flags.masking == "off") options.volume.masking = DynamicMasking::kOff;
  options.rooms.split_corridors = !flags.keeps_corridors;
  if (flags.rooms == "ceiling") options.rooms.method = RoomMethod::kCeiling;
  if (flags.rooms == "filtration") options.rooms.method = RoomMethod::kFiltration;
  if (flags.rooms == "clearance") options.rooms.method = RoomMethod::kClearance;
  if (flags.rooms == "paper") options.rooms.method = RoomMethod::kPaper;
  options.objects.is_paper = options.shapes.is_paper = flags.objects == "paper";
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

}  // namespace dsg::ingest
