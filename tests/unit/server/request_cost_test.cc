// SPDX-License-Identifier: Apache-2.0
// The estimated memory of a request is never less than the actual one, for any request.
#include "server/request_cost.h"

#include <google/protobuf/arena.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include <limits>
#include <string>

#include "dsg/v1/ingest_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "schema/base/random.h"

namespace dsg::server {
namespace {

constexpr size_t kNoLimit = std::numeric_limits<size_t>::max();

size_t BytesOf(const RequestCost& cost, const std::string& bytes, size_t bytes_max = kNoLimit) {
  google::protobuf::io::ArrayInputStream wire(bytes.data(), static_cast<int>(bytes.size()));
  return cost.Bytes(&wire, bytes_max);
}

template <typename Request>
size_t Estimate(const std::string& bytes, size_t bytes_max = kNoLimit) {
  return BytesOf(RequestCost(Request::descriptor()), bytes, bytes_max);
}

// Heap bytes of parsing on an arena like the server's.
template <typename Request>
size_t Measure(const std::string& bytes) {
  google::protobuf::ArenaOptions options;
  options.start_block_size = size_t{64} << 10;
  options.max_block_size = size_t{64} << 10;
  google::protobuf::Arena arena(options);
  const struct mallinfo2 before = mallinfo2();
  auto* const request = google::protobuf::Arena::CreateMessage<Request>(&arena);
  EXPECT_TRUE(request->ParseFromString(bytes));
  const struct mallinfo2 after = mallinfo2();
  return after.uordblks + after.hblkhd - before.uordblks - before.hblkhd;
}

template <typename Request>
void ExpectEnough(const std::string& bytes) {
  const size_t estimate = Estimate<Request>(bytes);
  const size_t measured = Measure<Request>(bytes);
  EXPECT_GE(estimate, measured) << bytes.size() << " bytes on the wire";
}

std::string Repeat(const std::string& bytes, int count) {
  std::string out;
  for (int i = 0; i < count; ++i) out += bytes;
  return out;
}

// A field of the delta in a commit that repeats `inner` `count` times.
std::string DeltaWith(const std::string& inner, int count) {
  v1::CommitRequest request;
  EXPECT_TRUE(request.mutable_delta()->ParseFromString(Repeat(inner, count)));
  return request.SerializeAsString();
}

TEST(RequestCost, CoversEmptySubMessages) {
  // Fields 8 to 24 of a delta are its lists of messages; an empty one is its tag and a zero.
  for (int field = 8; field <= 24; ++field) {
    const int tag = field << 3 | 2;
    std::string empty;
    if (tag >= 0x80) empty.push_back(static_cast<char>(0x80 | (tag & 0x7f)));
    empty.push_back(static_cast<char>(tag >= 0x80 ? tag >> 7 : tag));
    empty.push_back('\0');
    ExpectEnough<v1::CommitRequest>(DeltaWith(empty, 20'000));
  }
  v1::PlanPathsRequest paths;
  for (int i = 0; i < 20'000; ++i) paths.add_paths();
  ExpectEnough<v1::PlanPathsRequest>(paths.SerializeAsString());
}

TEST(RequestCost, CoversNumbersTextsAndMaps) {
  v1::CommitRequest request;
  v1::Node* const node = request.mutable_delta()->add_nodes();
  for (int i = 0; i < 20'000; ++i) {
    (*node->mutable_region()->mutable_class_probabilities())[std::to_string(i)] = i;
    (*node->mutable_attributes())[std::string(30, 'k') + std::to_string(i)];
  }
  ExpectEnough<v1::CommitRequest>(request.SerializeAsString());

  request.Clear();
  v1::MeshBlock* const block = request.mutable_delta()->add_mesh_blocks();
  for (int i = 0; i < 300'000; ++i) {
    block->add_faces(i % 100);
    block->add_first_seen_ns(i % 3);
    block->add_labels(0);
  }
  ExpectEnough<v1::CommitRequest>(request.SerializeAsString());

  v1::PlanPathRequest path;
  for (int i = 0; i < 20'000; ++i) path.add_blocked(std::string(static_cast<size_t>(i % 40), 'x'));
  ExpectEnough<v1::PlanPathRequest>(path.SerializeAsString());
}

TEST(RequestCost, CoversFieldsThatNobodyKnowsAndFieldsInOtherForms) {
  const std::string unknown_number("\xa0\x3f\x01", 3);     // field 1012, a varint
  const std::string unknown_text("\xa2\x3f\x00", 3);       // the same, of no bytes
  const std::string unknown_group("\xa3\x3f\xa4\x3f", 4);  // the same, an empty group
  const std::string map_as_number("\x08\x01", 2);          // the map's name, as a number
  const std::string parent_as_text("\x22\x00", 2);         // the parent revision, as text
  for (const std::string& field :
       {unknown_number, unknown_text, unknown_group, map_as_number, parent_as_text}) {
    ExpectEnough<v1::GraphDelta>(Repeat(field, 20'000));
  }
}

TEST(RequestCost, IsNotFarAboveWhatAnHonestDeltaTakes) {
  Random random(31, 0);
  v1::CommitRequest request;
  v1::TrajectoryAppend* const append = request.mutable_delta()->add_appends();
  append->set_agent("H1");
  for (int i = 0; i < 40'000; ++i) {
    v1::TimedPose* const pose = append->add_poses();
    pose->set_time_ns(1'700'000'000'000'000'000 + i);
    pose->mutable_pose()->mutable_position()->set_x(random.Uniform());
    pose->mutable_pose()->mutable_position()->set_y(random.Uniform());
    pose->mutable_pose()->mutable_position()->set_z(random.Uniform());
    pose->mutable_pose()->mutable_orientation()->set_w(random.Uniform());
    pose->mutable_pose()->mutable_orientation()->set_z(random.Uniform());
  }
  const std::string bytes = request.SerializeAsString();
  const size_t estimate = Estimate<v1::CommitRequest>(bytes);
  EXPECT_GE(estimate, Measure<v1::CommitRequest>(bytes));
  // So that 4 MiB of poses are well within the limit.
  EXPECT_LT(estimate, 6 * bytes.size());
}

TEST(RequestCost, CountsNoFurtherThanItsLimit) {
  const std::string bytes = DeltaWith(std::string("\x52\x00", 2), 1'000'000);
  const size_t estimate = Estimate<v1::CommitRequest>(bytes, size_t{1} << 20);
  EXPECT_GT(estimate, size_t{1} << 20);
  EXPECT_LT(estimate, size_t{2} << 20);
}

TEST(RequestCost, SurvivesAnyBytes) {
  Random random(32, 0);
  const RequestCost cost(v1::CommitRequest::descriptor());
  const std::string good = DeltaWith(std::string("\x52\x02\x0a\x00", 4), 50);
  for (int i = 0; i < 20'000; ++i) {
    std::string bytes = good.substr(0, static_cast<size_t>(random.Index(200)));
    for (char& byte : bytes) {
      if (random.Index(8) == 0) byte = static_cast<char>(random.Index(256));
    }
    EXPECT_LT(BytesOf(cost, bytes), size_t{1} << 20);
  }
  // Deeper than parsing allows.
  EXPECT_LT(BytesOf(cost, std::string(3'000'000, '\x0b')), size_t{1} << 20);
}

}  // namespace
}  // namespace dsg::server
