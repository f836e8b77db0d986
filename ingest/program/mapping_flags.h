// SPDX-License-Identifier: Apache-2.0
// The flags of dsg-ingest that concern static layers, and what it says of them at the end.
// Part of the program, not of the library.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "ingest/pipeline/mapping_options.h"

namespace CLI {
class App;
}

namespace dsg::ingest {

struct MappingFlags {
  bool is_off = false;
  double voxel_m = VolumeOptions().voxel_m;
  double range_m = VolumeOptions().range_m;
  std::string masking = "carve";
  std::string cad_folder;
  std::string rooms = "auto";
  bool keeps_corridors = false;
  std::string objects = "instances";
  std::string places = "ground";
  double robot_radius_m = PlaceOptions().robot_radius_m;
  double commit_s = 1.0;
  double mesh_s = 32.0;
  double layers_s = 5.0;
  bool is_fused_once = false;
  int thread_count = VolumeOptions().thread_count;
  /// Numbers of MappingOptions::Groups alone; the rest is not used.
  MappingOptions numbers;
  bool has_timings = false;
};

void AddMappingFlags(CLI::App* app, MappingFlags* flags);

/// Errors: INVALID_ARGUMENT/FIELD_INVALID naming the flag.
absl::StatusOr<MappingOptions> MakeMappingOptions(const MappingFlags& flags);

}  // namespace dsg::ingest
