// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/layers_options.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<StoreyOptions> kStoreyFields[] = {
    {"layers-floor-area", &StoreyOptions::floor_m2_min, 0.0, 1000.0,
     "Least area of a storey's floor, square metres: a smaller one is a landing or a platform"},
    {"layers-floor-apart", &StoreyOptions::floor_apart_m, 0.1, 20.0,
     "Least height between two storeys, metres: nobody stands below a lower one"},
    {"layers-robot-above", &StoreyOptions::robot_above_m, 0.1, 100.0,
     "How high above its floor the robot's camera is at most, metres: a storey"},
    {"layers-ceiling-min", &StoreyOptions::ceiling_m_min, 0.5, 20.0,
     "Least height of a ceiling above its floor, metres: lower ones are tables and lintels"},
    {"layers-ceiling-max", &StoreyOptions::ceiling_m_max, 1.0, 100.0,
     "Greatest height of it, metres: higher ones are another storey's", "layers-ceiling-min"},
    {"layers-ceiling-guess", &StoreyOptions::ceiling_guess_m, 1.0, 20.0,
     "Height of the ceiling where none is in sight, metres: that of homes"},
    {"layers-standing", &StoreyOptions::standing_m, 0.0, 2.0,
     "An object whose low side is this near to a floor stands on it, metres: thin legs are unseen"},
    {"layers-in-view", &StoreyOptions::in_view_m, 0.0, 10.0,
     "The middle of an object in view is this far behind its surface at most, metres, besides half "
     "its size: what stands before it hides a part"},
};

constexpr OptionField<LayersOptions> kLayersFields[] = {
    {"layers-mesh-wait-min", &LayersOptions::mesh_wait_min_ns, 0.0, 3600.0,
     "Log time that a change of a new piece of mesh waits for its commit, seconds: it changes with "
     "every frame, and each version stays in the history"},
    {"layers-cells-per-second", &LayersOptions::cells_per_second, 1e3, 1e12,
     "A large map is updated less often: a second of the log for so many cells of the grid, which "
     "keeps up with the log on one core"},
    {"layers-vertices-per-second", &LayersOptions::vertices_per_second, 1e2, 1e12,
     "... and for so many vertices of the mesh"},
    {"layers-path-step", &LayersOptions::path_step_m, 0.001, 10.0,
     "Poses of the camera closer together add nothing to its path, metres: a cell of the grid"},
    {"layers-fits", &LayersOptions::fit_count, 1, 1e6,
     "With --cad: fits of known shapes in one update while the log runs; the rest waits: each "
     "takes some tenths of a second"},
    {"layers-together-period", &LayersOptions::together_period_ns, 0.0, 3600.0,
     "How often it is looked which objects are in one picture, seconds: pictures between are "
     "alike"},
    {"layers-together-pictures", &LayersOptions::together_picture_count_min, 1, 1e6,
     "Objects are seen together that were in so many pictures: one is chance"},
    {"layers-together-partners", &LayersOptions::together_partner_count_max, 1, 1e6,
     "... of each object with so many others at most: those seen most often"},
};

}  // namespace

std::vector<BoundOption> LayersOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<StoreyOptions>(kStoreyFields, &storeys, &bound);
  BindFields<LayersOptions>(kLayersFields, this, &bound);
  return bound;
}

}  // namespace dsg::ingest
