// SPDX-License-Identifier: Apache-2.0
#include "server/status_mapping.h"

#include <gtest/gtest.h>

#include "absl/strings/escaping.h"
#include "dsg/v1/errors.pb.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "grpcpp/support/status.h"
#include "schema/base/status.h"

namespace dsg::server {
namespace {

// The first detail of that type; a default one with `found` false if there is none.
template <typename Detail>
Detail Find(const google::rpc::Status& status, bool* found) {
  Detail detail;
  *found = false;
  for (const auto& any : status.details()) {
    if (any.UnpackTo(&detail)) {
      *found = true;
      break;
    }
  }
  return detail;
}

grpc::Status Sent(const absl::Status& status) { return ToGrpc(ErrorStatus(status)); }

google::rpc::Status DetailsOf(const absl::Status& status) {
  google::rpc::Status told;
  EXPECT_TRUE(told.ParseFromString(Sent(status).error_details()));
  return told;
}

TEST(StatusMapping, KeepsEveryCodeAndMessage) {
  for (int code = 1; code <= 16; ++code) {
    const grpc::Status status =
        Sent(absl::Status(static_cast<absl::StatusCode>(code), "what failed"));
    EXPECT_EQ(static_cast<int>(status.error_code()), code);
    EXPECT_EQ(status.error_message(), "what failed");
  }
  EXPECT_TRUE(Sent(absl::OkStatus()).ok());
}

TEST(StatusMapping, SendsReasonDomainAndFacts) {
  const absl::Status status =
      MakeError(Reason::kTimeOutsideTrack, "too late", {{"first_ns", "1"}, {"last_ns", "9"}});
  v1::ErrorDetail detail;
  ASSERT_TRUE(detail.ParseFromString(OwnDetail(ErrorStatus(status))));
  EXPECT_EQ(detail.reason(), v1::TIME_OUTSIDE_TRACK);
  EXPECT_EQ(detail.domain(), "dsg");
  EXPECT_EQ(detail.metadata().at("first_ns"), "1");
  EXPECT_EQ(detail.metadata().at("last_ns"), "9");
}

TEST(StatusMapping, SendsNoDetailWithoutAReason) {
  EXPECT_EQ(OwnDetail(ErrorStatus(absl::CancelledError("left"))), "");
  EXPECT_EQ(OwnDetail(ErrorStatus(absl::OkStatus())), "");
}

TEST(StatusMapping, SendsTheDetailsThatAllClientsKnow) {
  const google::rpc::Status told = DetailsOf(MakeError(
      Reason::kFieldInvalid, "page_size is -1; give 0 to 1000", {{"field", "page_size"}}));
  EXPECT_EQ(told.code(), static_cast<int>(absl::StatusCode::kInvalidArgument));
  EXPECT_EQ(told.message(), "page_size is -1; give 0 to 1000");
  // Programs of before look at the first detail only.
  ASSERT_EQ(told.details_size(), 3);
  EXPECT_EQ(told.details(0).type_url(), "type.googleapis.com/dsg.v1.ErrorDetail");
  EXPECT_EQ(told.details(1).type_url(), "type.googleapis.com/google.rpc.ErrorInfo");
  bool found = false;
  EXPECT_EQ(Find<v1::ErrorDetail>(told, &found).reason(), v1::FIELD_INVALID);
  EXPECT_TRUE(found);
  const auto info = Find<google::rpc::ErrorInfo>(told, &found);
  EXPECT_TRUE(found);
  EXPECT_EQ(info.reason(), "FIELD_INVALID");
  EXPECT_EQ(info.domain(), "dsgdb");
  EXPECT_EQ(info.metadata().at("field"), "page_size");
  const auto bad = Find<google::rpc::BadRequest>(told, &found);
  ASSERT_EQ(bad.field_violations_size(), 1);
  EXPECT_EQ(bad.field_violations(0).field(), "page_size");
  EXPECT_EQ(bad.field_violations(0).description(), "page_size is -1; give 0 to 1000");
  Find<google::rpc::RetryInfo>(told, &found);
  EXPECT_FALSE(found);
}

TEST(StatusMapping, SaysWhenToRetryAndNamesNoFieldWhereNoneIsWrong) {
  bool found = false;
  const google::rpc::Status busy =
      DetailsOf(MakeError(Reason::kOverloaded, "busy", {{"retry_after_ms", "1200"}}));
  const auto retry = Find<google::rpc::RetryInfo>(busy, &found);
  EXPECT_TRUE(found);
  EXPECT_EQ(retry.retry_delay().seconds(), 1);
  EXPECT_EQ(retry.retry_delay().nanos(), 200'000'000);
  // Of a map, not of the request.
  const google::rpc::Status frames =
      DetailsOf(MakeError(Reason::kFramesIncompatible, "not one frame", {{"field", "frame"}}));
  for (const google::rpc::Status& told : {busy, frames}) {
    Find<google::rpc::BadRequest>(told, &found);
    EXPECT_FALSE(found);
  }
  for (const char* text : {"", "soon", "-5", "99999999999999999999"}) {
    Find<google::rpc::RetryInfo>(
        DetailsOf(MakeError(Reason::kOverloaded, "busy", {{"retry_after_ms", text}})), &found);
    EXPECT_FALSE(found) << text;
  }
}

TEST(StatusMapping, SendsCodeAndMessageAloneWithoutAReason) {
  EXPECT_EQ(Sent(absl::InternalError("why")).error_details(), "");
  EXPECT_EQ(Sent(absl::OkStatus()).error_details(), "");
  EXPECT_EQ(ErrorStatus(absl::InternalError("why")).message(), "why");
}

TEST(StatusMapping, CutsLongTextSoThatTrailersStayBelowWhatPeersAccept) {
  const std::string huge(1'000'000, '%');
  ErrorMetadata metadata = {{"field", huge}, {"value", huge}, {huge, "1"}};
  for (int i = 0; i < 100; ++i) metadata["key" + std::to_string(i)] = std::string(1000, '%');
  const absl::Status status = MakeError(Reason::kFieldInvalid, huge, metadata);
  const grpc::Status sent = Sent(status);
  EXPECT_EQ(sent.error_message().size(), kMessageBytesMax);
  const std::string own = OwnDetail(ErrorStatus(status));
  EXPECT_LT(own.size(), 1000u);
  // As it goes over the wire: each byte of the message as %25, bytes as base64.
  constexpr size_t kTrailerBytesMax = 8192;
  constexpr size_t kNamesAndOtherTrailers = 300;
  EXPECT_LT(3 * sent.error_message().size() + absl::Base64Escape(own).size() +
                absl::Base64Escape(sent.error_details()).size() + kNamesAndOtherTrailers,
            kTrailerBytesMax);
}

TEST(StatusMapping, LeavesTheFolderOfTheStoreOut) {
  const std::string folder = "/var/lib/dsg";
  const absl::Status missing =
      MakeError(Reason::kMapUnknown, "map \"a\" does not exist in store /var/lib/dsg; list them",
                {{"map", "a"}, {"folder", "/var/lib/dsg/a"}});
  EXPECT_EQ(HideFolder(missing, folder),
            MakeError(Reason::kMapUnknown, "map \"a\" does not exist in the store; list them",
                      {{"map", "a"}, {"folder", "a"}}));
  EXPECT_EQ(HideFolder(absl::InternalError("cannot sync /var/lib/dsg/a/graph.db"), folder),
            absl::InternalError("cannot sync a/graph.db"));
  EXPECT_EQ(HideFolder(missing, ""), missing);
}

TEST(StatusMapping, NeverCutsACharacterInTwo) {
  EXPECT_EQ(CutText("aüb", 2), "a");
  EXPECT_EQ(CutText("aüb", 3), "aü");
  EXPECT_EQ(CutText("\xF0\x9F\x98\x80!", 3), "");
  EXPECT_EQ(CutText("\xF0\x9F\x98\x80!", 5), "\xF0\x9F\x98\x80!");
}

TEST(StatusMapping, ReplacesWhatIsNotUtf8) {
  EXPECT_EQ(CutText("a\xFF\xC3", 10), "a??");
  // Overlong, surrogate, beyond Unicode: invalid UTF-8 that lax decoders accept.
  EXPECT_EQ(CutText("\xC0\xAF", 10), "??");
  EXPECT_EQ(CutText("\xED\xA0\x80", 10), "???");
  EXPECT_EQ(CutText("\xF4\x90\x80\x80", 10), "????");
  EXPECT_EQ(CutText("\xE2\x82\xAC", 10), "\xE2\x82\xAC");
}

}  // namespace
}  // namespace dsg::server
