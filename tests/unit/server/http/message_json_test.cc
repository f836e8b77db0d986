// SPDX-License-Identifier: Apache-2.0
#include "query/api/message_json.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/message.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/type_resolver.h>
#include <google/protobuf/util/type_resolver_util.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "dsg/v1/errors.pb.h"
#include "dsg/v1/ingest_service.pb.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "schema/base/random.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

namespace pb = google::protobuf;

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
    EXPECT_EQ(text->find('\n') == text->size() - 1, layout == JsonLayout::kOneLine);
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

TEST(MessageJson, NamesTheFieldThatMayBeMeant) {
  const auto& type = *v1::LocateAgentRequest::descriptor();
  const auto bytes = BytesOfJson(R"({"map": "m", "agnet": "a"})", type);
  EXPECT_NE(bytes.status().message().find("near in spelling: \"agent\""), std::string::npos)
      << bytes.status();
  EXPECT_EQ(MetadataOf(bytes.status()).at("field"), "agnet");
  const auto value = BytesOfJson(R"({"at_ns": "+30s"})", type);
  EXPECT_EQ(MetadataOf(value.status()).at("field"), "at_ns") << value.status();
  // Of parts of the request nothing is listed that would belong to another message.
  const auto part = BytesOfJson(R"({"read_at": {"agent": 1}})", type);
  EXPECT_EQ(MetadataOf(part.status()).at("field"), "") << part.status();
}

TEST(MessageJson, KeepsToItsBound) {
  const v1::GetTrajectoryResponse reply = Poses(5000);
  const size_t bytes = JsonOfMessage(reply, JsonLayout::kOneLine)->size();
  EXPECT_TRUE(JsonOfMessage(reply, JsonLayout::kOneLine, 2 * bytes).ok());
  EXPECT_EQ(ReasonOf(JsonOfMessage(reply, JsonLayout::kOneLine, bytes / 4).status()),
            Reason::kLimitExceeded);
}

// Protobuf's own printer.
std::string TextOfRival(const pb::Message& message, JsonLayout layout) {
  pb::util::JsonPrintOptions options;
  options.add_whitespace = layout == JsonLayout::kIndented;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  std::string bytes;
  {
    pb::io::StringOutputStream stream(&bytes);
    pb::io::CodedOutputStream out(&stream);
    // It writes maps in the order in which they come.
    out.SetSerializationDeterministic(true);
    message.SerializeToCodedStream(&out);
  }
  static pb::util::TypeResolver* const types = pb::util::NewTypeResolverForDescriptorPool(
      "type.googleapis.com", pb::DescriptorPool::generated_pool());
  std::string text;
  const auto status = pb::util::BinaryToJsonString(
      types, "type.googleapis.com/" + message.GetTypeName(), bytes, &text, options);
  EXPECT_TRUE(status.ok()) << status.ToString();
  return layout == JsonLayout::kIndented ? text : text + "\n";
}

const std::vector<int64_t> kWhole = {0,
                                     1,
                                     -1,
                                     42,
                                     std::numeric_limits<int32_t>::min(),
                                     1'700'000'000'000'000'001,
                                     std::numeric_limits<int64_t>::min()};
const std::vector<double> kReal = {0.0,
                                   -0.0,
                                   0.1,
                                   1e-300,
                                   1e22,
                                   -31.434202849870935,
                                   1.0 / 3,
                                   std::numeric_limits<double>::infinity(),
                                   -std::numeric_limits<double>::infinity(),
                                   std::nan("")};
const std::vector<std::string> kTexts = {"",
                                         "plain",
                                         "a \"b\" \\ c/d",
                                         "<script>&'",
                                         "line\nend\ttab\r\b\f",
                                         std::string("\0\x1f\x7f", 3),
                                         "\xc3\xa9\xe2\x80\xa8\xe2\x80\xa9\xef\xbb\xbf",
                                         "\xf0\x9f\x98\x80\xe2\x80\xae\xc2\xad"};

// Messages with random values in a random part of their fields.
class RandomMessages {
 public:
  explicit RandomMessages(uint64_t seed) : random_(seed, 0) {}

  std::unique_ptr<pb::Message> Make(const pb::Descriptor& type) {
    const pb::Message* const empty = pb::MessageFactory::generated_factory()->GetPrototype(&type);
    std::unique_ptr<pb::Message> made(empty->New());
    Fill(made.get(), 0);
    // Of two entries of a map with one key, one stays.
    std::unique_ptr<pb::Message> read(empty->New());
    EXPECT_TRUE(read->ParseFromString(made->SerializeAsString()));
    return read;
  }

 private:
  void Fill(pb::Message* message, int depth) {
    const pb::Descriptor& type = *message->GetDescriptor();
    for (int i = 0; i < type.field_count(); ++i) {
      const pb::FieldDescriptor* const field = type.field(i);
      if (random_.Index(3) == 0 || (depth > 4 && field->message_type() != nullptr)) continue;
      const int count = field->is_repeated() ? static_cast<int>(random_.Index(4)) : 1;
      for (int k = 0; k < count; ++k) Set(message, field, depth);
    }
  }

  void Set(pb::Message* message, const pb::FieldDescriptor* field, int depth) {
    using Field = pb::FieldDescriptor;
    using R = pb::Reflection;
    const R& r = *message->GetReflection();
    const auto one_of = [&](const auto& values) {
      return values[random_.Index(static_cast<int>(values.size()))];
    };
    const auto put = [&](auto add, auto set, auto value) {
      field->is_repeated() ? (r.*add)(message, field, value) : (r.*set)(message, field, value);
    };
    switch (field->cpp_type()) {
      case Field::CPPTYPE_INT32:
        return put(&R::AddInt32, &R::SetInt32, static_cast<int32_t>(one_of(kWhole)));
      case Field::CPPTYPE_UINT32:
        return put(&R::AddUInt32, &R::SetUInt32, static_cast<uint32_t>(one_of(kWhole)));
      case Field::CPPTYPE_INT64:
        return put(&R::AddInt64, &R::SetInt64, one_of(kWhole));
      case Field::CPPTYPE_UINT64:
        return put(&R::AddUInt64, &R::SetUInt64, static_cast<uint64_t>(one_of(kWhole)));
      case Field::CPPTYPE_DOUBLE:
        return put(&R::AddDouble, &R::SetDouble, RandomReal());
      case Field::CPPTYPE_FLOAT:
        return put(&R::AddFloat, &R::SetFloat, static_cast<float>(RandomReal()));
      case Field::CPPTYPE_BOOL:
        return put(&R::AddBool, &R::SetBool, random_.Index(2) == 0);
      case Field::CPPTYPE_ENUM:
        return put(&R::AddEnumValue, &R::SetEnumValue,
                   random_.Index(5) == 0 ? 9999 : static_cast<int>(random_.Index(4)));
      case Field::CPPTYPE_STRING:
        return put(&R::AddString, &R::SetString, one_of(kTexts));
      case Field::CPPTYPE_MESSAGE:
        Fill(field->is_repeated() ? r.AddMessage(message, field) : r.MutableMessage(message, field),
             depth + 1);
        return;
    }
  }

  double RandomReal() {
    if (random_.Chance(0.4)) return kReal[random_.Index(static_cast<int>(kReal.size()))];
    return random_.Uniform(-1, 1) * std::pow(10.0, random_.Index(30) - 15);
  }

  Random random_;
};

// Requests and replies of all methods.
std::vector<const pb::Descriptor*> AllTypes() {
  std::vector<const pb::Descriptor*> types;
  for (const auto* const file :
       {v1::LocateAgentRequest::descriptor()->file(), v1::ListMapsRequest::descriptor()->file(),
        v1::CommitRequest::descriptor()->file(), v1::PruneRequest::descriptor()->file()}) {
    for (int i = 0; i < file->service(0)->method_count(); ++i) {
      types.push_back(file->service(0)->method(i)->input_type());
      types.push_back(file->service(0)->method(i)->output_type());
    }
  }
  types.push_back(v1::ErrorDetail::descriptor());
  return types;
}

TEST(MessageJson, IsWhatProtobufWritesForEveryMessage) {
  const auto types = AllTypes();
  EXPECT_GE(types.size(), 78u);
  RandomMessages messages(20261127);
  for (const pb::Descriptor* type : types) {
    for (int i = 0; i < 40; ++i) {
      const auto message = messages.Make(*type);
      for (const JsonLayout layout : {JsonLayout::kIndented, JsonLayout::kOneLine}) {
        const auto text = JsonOfMessage(*message, layout);
        ASSERT_TRUE(text.ok()) << text.status();
        ASSERT_EQ(*text, TextOfRival(*message, layout)) << type->full_name();
      }
    }
  }
}

}  // namespace
}  // namespace dsg::query
