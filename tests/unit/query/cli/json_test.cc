// SPDX-License-Identifier: Apache-2.0
#include "query/cli/json.h"

#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "dsg/v1/maintenance_service.pb.h"

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

TEST(Json, KeepsNamesAndZeros) {
  const std::string text = TextOf(v1::CompactResponse());
  EXPECT_NE(text.find("\"file_bytes_before\": \"0\""), std::string::npos) << text;
  EXPECT_NE(text.find("\"done\": false"), std::string::npos) << text;
}

}  // namespace
}  // namespace dsg::cli
