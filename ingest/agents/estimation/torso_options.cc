// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/estimation/torso_options.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<TorsoOptions> kFields[] = {
    {"track-lag", &TorsoOptions::lag_count, 1, 1000,
     "Poses of a track that move while the log runs: older ones hardly do"},
    {"track-live-iterations", &TorsoOptions::live_iteration_count, 1, 100,
     "Iterations after each detection: warm starts need no more"},
    {"track-young", &TorsoOptions::young_count, 0, 1000,
     "A track of up to so many detections is young: it has no belief yet that a detection could "
     "contradict"},
    {"track-young-iterations", &TorsoOptions::young_iteration_count, 1, 100,
     "Iterations of a young track: it starts cold"},
    {"track-paper-walk", &TorsoOptions::walk_sigma_m_s, 0.01, 100.0,
     "With --people paper: how far somebody goes in a second, metres: a walk"},
    {"track-paper-turn", &TorsoOptions::turn_sigma_rad_s, 0.01, 100.0,
     "With --people paper: how far somebody turns in a second, radians: 60 degrees"},
    {"track-acceleration", &TorsoOptions::acceleration_sigma, 0.01, 100.0,
     "White noise on acceleration along the floor, metres / second^1.5: with track-memory, people "
     "walk at 1.4 metres / second"},
    {"track-vertical-acceleration", &TorsoOptions::vertical_acceleration_sigma, 0.001, 100.0,
     "The same upright, metres / second^1.5: people hardly leave their floor"},
    {"track-memory", &TorsoOptions::walk_memory_s, 0.01, 1000.0,
     "How long a velocity along the floor lasts, seconds: a walk through a room"},
    {"track-vertical-memory", &TorsoOptions::vertical_memory_s, 0.01, 1000.0,
     "How long one upright lasts, seconds: who sits down has done so after a second"},
    {"track-turn", &TorsoOptions::turn_walk_sigma_rad, 0.001, 100.0,
     "How far a heading wanders in a second, radians: walkers turn at corners only"},
    {"track-lasting-share", &TorsoOptions::lasting_share, 0.0, 0.95,
     "Share of a detection's variance along the ray that the next detections share: half of it is "
     "the body's height and what hides it"},
    {"track-lasting", &TorsoOptions::lasting_s, 0.01, 1000.0,
     "How long they share it, seconds: until people turn or come into sight"},
    {"track-height-lasting", &TorsoOptions::height_lasting_s, 0.01, 1000.0,
     "What is said of a body's height is given out over this, seconds: it is no news a second "
     "time"},
    {"track-loss", &TorsoOptions::loss_scale, 0.0, 100.0,
     "Detections that are off by more count less (Cauchy), in standard deviations; 0 = squares: "
     "one detection in some is of somebody else"},
    {"track-paper-loss", &TorsoOptions::paper_loss_scale, 0.0, 100.0,
     "The same with --people paper: the paper names no loss, and 0 is its letter"},
    {"track-tilt", &TorsoOptions::tilt_sigma_rad, 0.001, 3.0,
     "Error of a detection's roll and pitch, radians; but for --people paper they stay as "
     "detected"},
};

}  // namespace

std::vector<BoundOption> TorsoOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<TorsoOptions>(kFields, this, &bound);
  return bound;
}

}  // namespace dsg::ingest
