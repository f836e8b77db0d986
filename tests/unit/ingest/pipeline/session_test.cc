// SPDX-License-Identifier: Apache-2.0
// The identity of a session: log and configuration, nothing else.
#include "ingest/pipeline/session.h"

#include <gtest/gtest.h>

namespace dsg::ingest {
namespace {

TEST(SessionId, ChangesWithContentAndEveryOption) {
  const SessionConfig base{.format = "obsmat",
                           .epoch_ns = 1,
                           .frame_period_ns = 2,
                           .agent_prefix = "a",
                           .mesh_block_size_m = 2.0,
                           .poses_per_delta = 3};
  const std::string id = SessionId("abc", base);
  EXPECT_EQ(id, SessionId("abc", base));
  EXPECT_EQ(id.size(), 36u);
  EXPECT_TRUE(id.starts_with("log-"));
  EXPECT_NE(id, SessionId("abd", base));
  SessionConfig other = base;
  other.format = "trajnet";
  EXPECT_NE(id, SessionId("abc", other));
  other = base;
  other.epoch_ns = 2;
  EXPECT_NE(id, SessionId("abc", other));
  other = base;
  other.frame_period_ns = 3;
  EXPECT_NE(id, SessionId("abc", other));
  other = base;
  other.agent_prefix = "b";
  EXPECT_NE(id, SessionId("abc", other));
  other = base;
  other.mesh_block_size_m = 2.5;
  EXPECT_NE(id, SessionId("abc", other));
  other = base;
  other.poses_per_delta = 4;
  EXPECT_NE(id, SessionId("abc", other));
  other = base;
  other.poses = "gt";
  EXPECT_NE(id, SessionId("abc", other));
}

}  // namespace
}  // namespace dsg::ingest
