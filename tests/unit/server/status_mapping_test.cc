// SPDX-License-Identifier: Apache-2.0
#include "server/status_mapping.h"

#include <gtest/gtest.h>

#include "dsg/v1/errors.pb.h"
#include "grpcpp/support/status.h"
#include "schema/base/status.h"

namespace dsg::server {
namespace {

TEST(StatusMapping, KeepsEveryCodeAndMessage) {
  for (int code = 1; code <= 16; ++code) {
    const grpc::Status status =
        ToGrpc(absl::Status(static_cast<absl::StatusCode>(code), "what failed"));
    EXPECT_EQ(static_cast<int>(status.error_code()), code);
    EXPECT_EQ(status.error_message(), "what failed");
  }
  EXPECT_TRUE(ToGrpc(absl::OkStatus()).ok());
}

TEST(StatusMapping, SendsReasonDomainAndFacts) {
  const absl::Status status =
      MakeError(Reason::kTimeOutsideTrack, "too late", {{"first_ns", "1"}, {"last_ns", "9"}});
  v1::ErrorDetail detail;
  ASSERT_TRUE(detail.ParseFromString(EncodeErrorDetail(status)));
  EXPECT_EQ(detail.reason(), v1::TIME_OUTSIDE_TRACK);
  EXPECT_EQ(detail.domain(), "dsg");
  EXPECT_EQ(detail.metadata().at("first_ns"), "1");
  EXPECT_EQ(detail.metadata().at("last_ns"), "9");
}

TEST(StatusMapping, SendsNoDetailWithoutAReason) {
  EXPECT_EQ(EncodeErrorDetail(absl::CancelledError("left")), "");
  EXPECT_EQ(EncodeErrorDetail(absl::OkStatus()), "");
}

TEST(StatusMapping, CutsLongTextSoThatTrailersStayBelowWhatPeersAccept) {
  const std::string huge(1'000'000, 'x');
  const absl::Status status = MakeError(Reason::kFieldInvalid, huge, {{"value", huge}});
  EXPECT_EQ(ToGrpc(status).error_message().size(), kMessageBytesMax);
  EXPECT_LT(EncodeErrorDetail(status).size(), 1000u);
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
