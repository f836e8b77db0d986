// SPDX-License-Identifier: Apache-2.0
#include "server/http/connect.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "absl/strings/escaping.h"
#include "dsg/v1/errors.pb.h"
#include "google/rpc/status.pb.h"
#include "grpcpp/support/status.h"
#include "schema/base/status.h"
#include "server/status_mapping.h"

namespace dsg::server {
namespace {

using nlohmann::json;

std::string Envelope(int flags, const std::string& length, const std::string& message) {
  return std::string(1, static_cast<char>(flags)) + length + message;
}

TEST(Connect, KnowsFourTypesToTheLetter) {
  for (const char* name : {"application/json", "application/proto", "application/connect+json",
                           "application/connect+proto"}) {
    const auto type = ReadConnectType(name);
    ASSERT_TRUE(type.has_value()) << name;
    EXPECT_EQ(NameOf(*type), name);
  }
  for (const char* name : {"", "text/plain", "application/x-www-form-urlencoded",
                           "multipart/form-data", "application/json; charset=utf-8",
                           "application/JSON", " application/json", "application/grpc+proto"}) {
    EXPECT_FALSE(ReadConnectType(name).has_value()) << name;
  }
}

TEST(Connect, ReadsTimeoutsOfAtMostTenDigits) {
  EXPECT_EQ(ReadTimeout("0")->count(), 0);
  EXPECT_EQ(ReadTimeout("1500")->count(), 1500);
  EXPECT_EQ(ReadTimeout("9999999999")->count(), 9'999'999'999);
  for (const char* text : {"", "-1", "1s", "1.5", "10000000000", " 1", "+1", "0x10"}) {
    EXPECT_EQ(ReasonOf(ReadTimeout(text).status()), Reason::kFieldInvalid) << text;
  }
}

TEST(Connect, WritesErrorsWithTheirDetails) {
  const auto error = MakeError(Reason::kMapUnknown, "there is no map \"x\"", {{"map", "x"}});
  const json told = json::parse(ErrorJson(error));
  EXPECT_EQ(told["code"], "not_found");
  EXPECT_EQ(told["message"], "there is no map \"x\"");
  ASSERT_EQ(told["details"].size(), 2u);
  const json& detail = told["details"][0];
  EXPECT_EQ(detail["type"], "dsg.v1.ErrorDetail");
  EXPECT_EQ(detail["debug"]["reason"], "MAP_UNKNOWN");
  EXPECT_EQ(detail["debug"]["metadata"]["map"], "x");
  const std::string value = detail["value"];
  EXPECT_EQ(value.find('='), std::string::npos);
  std::string bytes;
  ASSERT_TRUE(absl::Base64Unescape(value, &bytes));
  v1::ErrorDetail read;
  ASSERT_TRUE(read.ParseFromString(bytes));
  EXPECT_EQ(read.reason(), v1::MAP_UNKNOWN);
  EXPECT_EQ(told["details"][1]["type"], "google.rpc.ErrorInfo");
  EXPECT_EQ(told["details"][1]["debug"]["domain"], "dsgdb");
  EXPECT_EQ(told["details"][1]["debug"]["reason"], "MAP_UNKNOWN");
  EXPECT_EQ(HttpStatusOf(error.code()), 404);
}

TEST(Connect, WritesTheSameDetailsAsGrpc) {
  for (const auto& error : {MakeError(Reason::kFieldInvalid, "k is 0", {{"field", "k"}}),
                            MakeError(Reason::kOverloaded, "busy", {{"retry_after_ms", "200"}})}) {
    google::rpc::Status sent;
    ASSERT_TRUE(sent.ParseFromString(ToGrpc(ErrorStatus(error)).error_details()));
    const json details = json::parse(ErrorJson(error))["details"];
    ASSERT_EQ(details.size(), 3u);
    ASSERT_EQ(sent.details_size(), 3);
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ("type.googleapis.com/" + details[i]["type"].get<std::string>(),
                sent.details(i).type_url());
      std::string bytes;
      ASSERT_TRUE(absl::Base64Unescape(details[i]["value"].get<std::string>(), &bytes));
      EXPECT_EQ(bytes, sent.details(i).value());
      EXPECT_TRUE(details[i]["debug"].is_object());
    }
  }
}

TEST(Connect, HasANameAndAStatusForEveryCode) {
  std::set<std::string> names;
  for (int code = 1; code <= 16; ++code) {
    const absl::Status error(static_cast<absl::StatusCode>(code), "why");
    const json told = json::parse(ErrorJson(error));
    names.insert(told["code"].get<std::string>());
    EXPECT_FALSE(told.contains("details"));
    EXPECT_GE(HttpStatusOf(error.code()), 400);
  }
  EXPECT_EQ(names.size(), 16u);
}

TEST(Connect, WritesErrorsOfAnyBytesAsUtf8) {
  const auto error = MakeError(Reason::kFieldInvalid, std::string("a\xff\"\n\0b", 6),
                               {{"value", std::string("\xc3\x28", 2)}});
  EXPECT_TRUE(json::accept(ErrorJson(error)));
  EXPECT_TRUE(json::accept(EndOfStream(error).substr(kEnvelopeBytes)));
}

TEST(Connect, EndsStreamsWithHowTheyEnded) {
  const std::string good = EndOfStream(absl::OkStatus());
  EXPECT_EQ(good, Envelope(2, std::string("\0\0\0\x02", 4), "{}"));
  const std::string bad = EndOfStream(MakeError(Reason::kShuttingDown, "stopping"));
  EXPECT_EQ(bad[0], 2);
  const json told = json::parse(bad.substr(kEnvelopeBytes));
  EXPECT_EQ(told["error"]["code"], "unavailable");
  EXPECT_EQ(told["metadata"]["dsg-error-bin"][0], told["error"]["details"][0]["value"]);
}

TEST(Connect, OpensOneEnvelopeOnly) {
  const std::string message(70'000, 'x');
  EXPECT_EQ(*OpenEnvelope(EnvelopeOf(message.size()) + message), message);
  EXPECT_EQ(*OpenEnvelope(EnvelopeOf(0)), "");
  for (const std::string& body :
       {std::string(), std::string("\0\0\0\0", 4), EnvelopeOf(3) + "ab", EnvelopeOf(1) + "ab",
        Envelope(1, std::string("\0\0\0\x01", 4), "a"),
        Envelope(2, std::string("\0\0\0\x02", 4), "{}"), Envelope(0, "\xff\xff\xff\xff", "a")}) {
    EXPECT_EQ(ReasonOf(OpenEnvelope(body).status()), Reason::kFieldInvalid);
  }
}

}  // namespace
}  // namespace dsg::server
