// SPDX-License-Identifier: Apache-2.0
#include "query/api/message_json.h"

#include <gtest/gtest.h>

#include <thread>

#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

v1::GetTrajectoryResponse Poses(int count) {
  v1::GetTrajectoryResponse reply;
  for (int i = 0; i < count; ++i) {
    v1::TimedPose* const pose = reply.add_poses();
    pose->set_time_ns(1'700'000'000'000'000'000 + i);
    pose->mutable_pose()->mutable_position()->set_x(0.1 * i);
  }
  return reply;
}

TEST(MessageJson, ReadsWhatItWrites) {
  const v1::GetTrajectoryResponse reply = Poses(50);
  for (const JsonLayout layout : {JsonLayout::kIndented, JsonLayout::kOneLine}) {
    const auto text = JsonOfMessage(reply, layout);
    ASSERT_TRUE(text.ok()) << text.status();
    EXPECT_EQ(text->back(), '\n');
    if (layout == JsonLayout::kOneLine) EXPECT_EQ(text->find('\n'), text->size() - 1);
    const auto bytes = BytesOfJson(*text, *v1::GetTrajectoryResponse::descriptor());
    ASSERT_TRUE(bytes.ok()) << bytes.status();
    v1::GetTrajectoryResponse read;
    ASSERT_TRUE(read.ParseFromString(*bytes));
    EXPECT_EQ(read.SerializeAsString(), reply.SerializeAsString());
  }
}

TEST(MessageJson, RefusesWhatIsNoSuchMessage) {
  const auto& type = *v1::LocateAgentRequest::descriptor();
  EXPECT_TRUE(BytesOfJson(R"({"map": "m", "agent": "a", "atNs": "5"})", type).ok());
  EXPECT_TRUE(BytesOfJson("{}", type).ok());
  std::string deep;
  for (int i = 0; i < 100'000; ++i) deep += "{\"read_at\":";
  for (const std::string& text :
       {std::string("{"), std::string("[]"), std::string("{\"agnet\": \"a\"}"),
        std::string("{\"map\": 5}"), std::string("{\"at_ns\": \"1e400\"}"), std::string("\xff\xfe"),
        std::string("{\"map\": \"\\ud800\"}"), deep, std::string(100'000, '[')}) {
    const auto bytes = BytesOfJson(text, type);
    EXPECT_EQ(ReasonOf(bytes.status()), Reason::kFieldInvalid) << text.substr(0, 40);
    EXPECT_LT(bytes.status().message().size(), 1000u);
  }
}

TEST(MessageJson, KeepsToItsBound) {
  const v1::GetTrajectoryResponse reply = Poses(5000);
  const size_t bytes = JsonOfMessage(reply, JsonLayout::kOneLine)->size();
  EXPECT_TRUE(JsonOfMessage(reply, JsonLayout::kOneLine, 2 * bytes).ok());
  EXPECT_EQ(ReasonOf(JsonOfMessage(reply, JsonLayout::kOneLine, bytes / 4).status()),
            Reason::kLimitExceeded);
}

TEST(MessageJson, WritesFromManyThreadsAtOnce) {
  const v1::GetTrajectoryResponse reply = Poses(20);
  const std::string text = *JsonOfMessage(reply, JsonLayout::kIndented);
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      for (int k = 0; k < 50; ++k) EXPECT_EQ(*JsonOfMessage(reply, JsonLayout::kIndented), text);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace dsg::query
