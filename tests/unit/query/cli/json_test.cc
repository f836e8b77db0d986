// SPDX-License-Identifier: Apache-2.0
#include "query/cli/json.h"

#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/query_service.pb.h"

namespace dsg::cli {
namespace {

std::string TextOf(const google::protobuf::Message& reply) {
  std::ostringstream out;
  EXPECT_TRUE(WriteJson(reply, out).ok());
  return out.str();
}

TEST(Json, OfAMapIsTheSameHoweverTheReplyWasMade) {
  v1::MergeMapsResponse upward;
  v1::MergeMapsResponse downward;
  for (int i = 0; i < 300; ++i) {
    (*upward.mutable_node_ids())["O" + std::to_string(i)] = "p" + std::to_string(i);
  }
  for (int i = 299; i >= 0; --i) {
    (*downward.mutable_node_ids())["O" + std::to_string(i)] = "p" + std::to_string(i);
  }
  const std::string text = TextOf(upward);
  EXPECT_EQ(text, TextOf(downward));
  v1::MergeMapsResponse sent;
  ASSERT_TRUE(sent.ParseFromString(upward.SerializeAsString()));
  EXPECT_EQ(text, TextOf(sent));
  EXPECT_LT(text.find("\"O1\""), text.find("\"O2\""));
  EXPECT_LT(text.find("\"O2\""), text.find("\"O298\""));
  EXPECT_LT(text.find("\"O298\""), text.find("\"O3\""));
}

// In parts of `part_sizes` poses, the first of which has the rest of the reply.
std::string TextOfParts(const v1::GetTrajectoryResponse& reply,
                        const std::vector<int>& part_sizes) {
  std::ostringstream out;
  JsonListWriter writer("poses", &out);
  int next = 0;
  for (size_t i = 0; i < part_sizes.size(); ++i) {
    v1::GetTrajectoryResponse part;
    if (i == 0) {
      part = reply;
      part.clear_poses();
    }
    for (int k = 0; k < part_sizes[i]; ++k) *part.add_poses() = reply.poses(next++);
    EXPECT_TRUE(writer.Add(part).ok());
  }
  writer.End();
  return out.str();
}

TEST(Json, InPartsIsThatOfTheWhole) {
  v1::GetTrajectoryResponse reply;
  reply.mutable_header()->set_read_revision(7);
  reply.set_agent_id("H1 \"]\" \n ]");
  EXPECT_EQ(TextOfParts(reply, {0}), TextOf(reply));
  EXPECT_EQ(TextOfParts(reply, {0, 0}), TextOf(reply));
  for (int i = 0; i < 12; ++i) {
    v1::TimedPose* const pose = reply.add_poses();
    pose->set_time_ns(i);
    pose->mutable_pose()->mutable_position()->set_x(0.1 * i);
    for (int k = 0; k < 21 * (i % 2); ++k) pose->add_covariance(0.5f);
  }
  for (const std::vector<int>& sizes :
       {std::vector<int>{12}, {0, 12}, {5, 7}, {1, 0, 11}, {4, 4, 4, 0}}) {
    EXPECT_EQ(TextOfParts(reply, sizes), TextOf(reply));
  }
}

TEST(Json, KeepsNamesAndZeros) {
  const std::string text = TextOf(v1::CompactResponse());
  EXPECT_NE(text.find("\"file_bytes_before\": \"0\""), std::string::npos) << text;
  EXPECT_NE(text.find("\"done\": false"), std::string::npos) << text;
}

}  // namespace
}  // namespace dsg::cli
