// SPDX-License-Identifier: Apache-2.0
// Worlds and motions for the tests of this folder.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "ingest/simulator/motion/robot_motion.h"

namespace dsg::simulator {

inline World MakeWorld(WorldKind kind, uint64_t seed) {
  absl::StatusOr<World> world = GenerateWorld({kind, seed});
  EXPECT_TRUE(world.ok()) << world.status();
  return *std::move(world);
}

inline std::unique_ptr<RobotMotion> MakeMotion(WorldKind kind, uint64_t seed,
                                               const RobotMotionOptions& options) {
  return RobotMotion::Make(MakeWorld(kind, seed), options, seed);
}

}  // namespace dsg::simulator
