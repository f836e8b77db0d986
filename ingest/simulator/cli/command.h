// SPDX-License-Identifier: Apache-2.0
// The verbs of dsg-simulate: each adds its options to the command line and runs when chosen.
// Refuses to do what the libraries behind it do.
#pragma once

#include <functional>
#include <string>

#include "absl/status/status.h"

namespace CLI {
class App;
}

namespace dsg::simulator {

/// What to run once the command line is read.
using Command = std::function<absl::Status()>;

/// People walking between rooms and a robot touring them, as tracks.
Command AddTracksCommand(CLI::App* app);
/// Cameras, inertial unit and human detections of a robot in a building, as a log.
Command AddSensorsCommand(CLI::App* app);
/// Pictures of a sensor log.
Command AddPreviewCommand(CLI::App* app);
/// Drifting odometry and loop closures beside a sensor log.
Command AddDriftCommand(CLI::App* app);

}  // namespace dsg::simulator
