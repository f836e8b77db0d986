// SPDX-License-Identifier: Apache-2.0
#include "ingest/program/mapping_flags.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
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

// Groups of options of single stages, which few runs need.
constexpr absl::string_view kTuning = "Tuning: ";

// Help with one line for each group of tuning, unless all is asked for.
class ShortHelp : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override {
    shows_all_ = mode == CLI::AppFormatMode::All;
    return CLI::Formatter::make_help(app, std::move(name), mode);
  }

  std::string make_group(std::string group, bool is_positional,
                         std::vector<const CLI::Option*> options) const override {
    if (shows_all_ || !absl::StartsWith(group, kTuning)) {
      return CLI::Formatter::make_group(std::move(group), is_positional, std::move(options));
    }
    return absl::StrCat("\n", group, ": ", options.size(), " options, see --help-all\n");
  }

 private:
  mutable bool shows_all_ = false;
};

// As ValidateFields has it, so that all ways say the same.
CLI::Validator InRange(BoundOption field) {
  return CLI::Validator(
      [field](const std::string& text) mutable {
        double value = 0.0;
        if (!absl::SimpleAtod(text, &value)) return absl::StrCat(text, " is no number");
        field.value = &value;
        return std::string(ValidateFields({&field, 1}).message());
      },
      absl::StrCat("in [", field.min, " - ", field.max, "]"));
}

void AddTuning(const std::string& stage, std::span<const BoundOption> fields, CLI::App* app) {
  for (const BoundOption& field : fields) {
    app->add_option(absl::StrCat("--", field.name), *field.value, field.help)
        ->check(InRange(field))
        ->capture_default_str()
        ->group(absl::StrCat(kTuning, stage));
  }
}

}  // namespace

void AddMappingFlags(CLI::App* app, MappingFlags* flags) {
  app->formatter(std::make_shared<ShortHelp>());
  app->set_help_all_flag("--help-all", "Print the options of all groups");
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
  app->add_flag("--whole-corridors", flags->keeps_corridors,
                "A net of corridors is one room; otherwise each of its straight arms is")
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
  AddTuning("scans of lidars", flags->cloud.Bind(), app);
  AddTuning("walls, floors and ceilings", flags->structures.Bind(), app);
  AddTuning("places", flags->place_options.Bind(), app);
  AddTuning("rooms", flags->room_options.Bind(), app);
  AddTuning("objects of logs without labels", flags->segments.Bind(), app);
  AddTuning("memory", flags->spill.Bind(), app);
}

absl::StatusOr<MappingOptions> MakeMappingOptions(const MappingFlags& flags) {
  MappingOptions options;
  options.is_on = !flags.is_off;
  options.volume.voxel_m = flags.voxel_m;
  options.volume.range_m = flags.range_m;
  options.volume.thread_count = flags.thread_count;
  if (flags.masking == "drop") options.volume.masking = DynamicMasking::kDrop;
  if (flags.masking == "off") options.volume.masking = DynamicMasking::kOff;
  options.depth.cloud = flags.cloud;
  options.structures = flags.structures;
  options.rooms = flags.room_options;
  options.rooms.split_corridors = !flags.keeps_corridors;
  if (flags.rooms == "ceiling") options.rooms.method = RoomMethod::kCeiling;
  if (flags.rooms == "filtration") options.rooms.method = RoomMethod::kFiltration;
  if (flags.rooms == "clearance") options.rooms.method = RoomMethod::kClearance;
  options.places = flags.place_options;
  if (flags.places == "volume") options.places.mode = PlaceMode::kVolume;
  options.places.robot_radius_m = flags.robot_radius_m;
  options.segments = flags.segments;
  options.volume.spill = flags.spill;
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
