// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/status_decode.h"

#include <google/protobuf/stubs/logging.h>
#include <gtest/gtest.h>

#include <random>
#include <string>

#include "dsg/v1/errors.pb.h"
#include "schema/base/status.h"

namespace dsg {
namespace {

constexpr int kNotFound = 5;
constexpr int kDataLoss = 15;

std::string Detail(v1::Reason reason, const std::string& domain = "dsg") {
  v1::ErrorDetail detail;
  detail.set_reason(reason);
  detail.set_domain(domain);
  (*detail.mutable_metadata())["agent"] = "H12";
  return detail.SerializeAsString();
}

TEST(StatusDecode, OkNeedsNoDetail) {
  EXPECT_TRUE(DecodeStatus(0, "", "").ok());
  EXPECT_TRUE(DecodeStatus(0, "", Detail(v1::AGENT_UNKNOWN)).ok());
}

TEST(StatusDecode, GivesBackWhatTheServerMade) {
  const absl::Status status =
      DecodeStatus(kNotFound, "agent H12 is unknown", Detail(v1::AGENT_UNKNOWN));
  EXPECT_EQ(status, MakeError(Reason::kAgentUnknown, "agent H12 is unknown", {{"agent", "H12"}}));
}

TEST(StatusDecode, EveryReasonComesBackWithItsCode) {
  for (int number = v1::Reason_MIN + 1; number <= v1::Reason_MAX; ++number) {
    if (!v1::Reason_IsValid(number)) continue;
    const auto reason = static_cast<Reason>(number);
    const absl::Status status = DecodeStatus(static_cast<int>(CodeOf(reason)), "m",
                                             Detail(static_cast<v1::Reason>(number)));
    EXPECT_EQ(ReasonOf(status), reason) << number;
    EXPECT_EQ(status.code(), CodeOf(reason)) << number;
  }
}

TEST(StatusDecode, ReasonOfAnotherCodeIsLeftOut) {
  const absl::Status status = DecodeStatus(kDataLoss, "m", Detail(v1::AGENT_UNKNOWN));
  EXPECT_EQ(status, absl::DataLossError("m"));
}

TEST(StatusDecode, UnknownReasonLeavesTheCode) {
  const absl::Status status = DecodeStatus(kNotFound, "m", Detail(static_cast<v1::Reason>(39)));
  EXPECT_EQ(status, absl::NotFoundError("m"));
}

TEST(StatusDecode, ForeignDomainIsLeftOut) {
  const absl::Status status = DecodeStatus(kNotFound, "m", Detail(v1::AGENT_UNKNOWN, "other"));
  EXPECT_EQ(status, absl::NotFoundError("m"));
}

TEST(StatusDecode, CodeOutsideGrpcIsUnknown) {
  EXPECT_EQ(DecodeStatus(99, "m", "").code(), absl::StatusCode::kUnknown);
  EXPECT_EQ(DecodeStatus(-1, "m", "").code(), absl::StatusCode::kUnknown);
}

TEST(StatusDecode, DamagedDetailNeverChangesCodeOrMessage) {
  const uint32_t seed = 20240607;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  const google::protobuf::LogSilencer silencer;
  for (int i = 0; i < 2000; ++i) {
    std::string bytes = Detail(v1::AGENT_UNKNOWN);
    bytes.resize(random() % (bytes.size() + 1));
    if (!bytes.empty()) bytes[random() % bytes.size()] = static_cast<char>(random());
    const absl::Status status = DecodeStatus(kNotFound, "m", bytes);
    EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
    EXPECT_EQ(status.message(), "m");
  }
}

}  // namespace
}  // namespace dsg
