// SPDX-License-Identifier: Apache-2.0
#include "schema/base/status.h"

#include <gtest/gtest.h>

#include "dsg/v1/errors.pb.h"

namespace dsg {
namespace {

TEST(Status, CarriesReasonMetadataAndTheReasonsCode) {
  const auto error = MakeError(Reason::kNodeUnknown, "node O1 is unknown", {{"node", "O1"}});
  EXPECT_EQ(error.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(ReasonOf(error), Reason::kNodeUnknown);
  EXPECT_EQ(MetadataOf(error), (ErrorMetadata{{"node", "O1"}}));
}

TEST(Status, KeepsMetadataWhoseValuesHoldTabsAndNewlines) {
  const auto error = MakeError(Reason::kFieldInvalid, "x", {{"a", "1\n2\t3"}, {"b", ""}});
  EXPECT_EQ(MetadataOf(error), (ErrorMetadata{{"a", "1 2 3"}, {"b", ""}}));
}

TEST(Status, AnnotateKeepsCodeAndReason) {
  const auto error = Annotate(MakeError(Reason::kDiskFull, "full"), "writing map \"x\"");
  EXPECT_EQ(error.message(), "writing map \"x\": full");
  EXPECT_EQ(ReasonOf(error), Reason::kDiskFull);
  EXPECT_EQ(error.code(), absl::StatusCode::kResourceExhausted);
}

TEST(Status, OkAndForeignErrorsHaveNoReason) {
  EXPECT_EQ(ReasonOf(absl::OkStatus()), Reason::kUnspecified);
  EXPECT_EQ(ReasonOf(absl::InternalError("x")), Reason::kUnspecified);
  EXPECT_TRUE(MetadataOf(absl::InternalError("x")).empty());
}

TEST(Status, ReasonsHaveTheNumbersOfTheWire) {
  struct Pair {
    Reason ours;
    v1::Reason wire;
  };
  const Pair pairs[] = {
      {Reason::kFieldInvalid, v1::FIELD_INVALID},
      {Reason::kMapNameInvalid, v1::MAP_NAME_INVALID},
      {Reason::kNodeIdInvalid, v1::NODE_ID_INVALID},
      {Reason::kTimeRangeInverted, v1::TIME_RANGE_INVERTED},
      {Reason::kBoxInverted, v1::BOX_INVERTED},
      {Reason::kNumberNotFinite, v1::NUMBER_NOT_FINITE},
      {Reason::kPageTokenMismatch, v1::PAGE_TOKEN_MISMATCH},
      {Reason::kDeltaInvalid, v1::DELTA_INVALID},
      {Reason::kFileMalformed, v1::FILE_MALFORMED},
      {Reason::kQueryMalformed, v1::QUERY_MALFORMED},
      {Reason::kMapUnknown, v1::MAP_UNKNOWN},
      {Reason::kNodeUnknown, v1::NODE_UNKNOWN},
      {Reason::kAgentUnknown, v1::AGENT_UNKNOWN},
      {Reason::kLayerUnknown, v1::LAYER_UNKNOWN},
      {Reason::kAssetUnknown, v1::ASSET_UNKNOWN},
      {Reason::kClassUnknown, v1::CLASS_UNKNOWN},
      {Reason::kRelationUnknown, v1::RELATION_UNKNOWN},
      {Reason::kNoPath, v1::NO_PATH},
      {Reason::kTagUnknown, v1::TAG_UNKNOWN},
      {Reason::kNoRegistration, v1::NO_REGISTRATION},
      {Reason::kTimeOutsideTrack, v1::TIME_OUTSIDE_TRACK},
      {Reason::kRevisionInFuture, v1::REVISION_IN_FUTURE},
      {Reason::kRevisionCompacted, v1::REVISION_COMPACTED},
      {Reason::kTimeOutsideMap, v1::TIME_OUTSIDE_MAP},
      {Reason::kMapExists, v1::MAP_EXISTS},
      {Reason::kTrackConflict, v1::TRACK_CONFLICT},
      {Reason::kFormatTooNew, v1::FORMAT_TOO_NEW},
      {Reason::kFormatTooOld, v1::FORMAT_TOO_OLD},
      {Reason::kNotAStore, v1::NOT_A_STORE},
      {Reason::kNetworkFileSystem, v1::NETWORK_FILE_SYSTEM},
      {Reason::kReadOnly, v1::READ_ONLY},
      {Reason::kPolicyMatchesAll, v1::POLICY_MATCHES_ALL},
      {Reason::kFramesIncompatible, v1::FRAMES_INCOMPATIBLE},
      {Reason::kParentRevisionStale, v1::PARENT_REVISION_STALE},
      {Reason::kSequenceReused, v1::SEQUENCE_REUSED},
      {Reason::kTimeImplausible, v1::TIME_IMPLAUSIBLE},
      {Reason::kPolicyTakesTooMuch, v1::POLICY_TAKES_TOO_MUCH},
      {Reason::kSequenceGap, v1::SEQUENCE_GAP},
      {Reason::kMapReplaced, v1::MAP_REPLACED},
      {Reason::kWriterLocked, v1::WRITER_LOCKED},
      {Reason::kShuttingDown, v1::SHUTTING_DOWN},
      {Reason::kCommitOutcomeUnknown, v1::COMMIT_OUTCOME_UNKNOWN},
      {Reason::kOverloaded, v1::OVERLOADED},
      {Reason::kDiskFull, v1::DISK_FULL},
      {Reason::kLimitExceeded, v1::LIMIT_EXCEEDED},
      {Reason::kQuotaExceeded, v1::QUOTA_EXCEEDED},
      {Reason::kStoreCorrupt, v1::STORE_CORRUPT},
  };
  for (const auto& [ours, wire] : pairs) EXPECT_EQ(static_cast<int>(ours), static_cast<int>(wire));
  // REASON_UNSPECIFIED is the one not listed above.
  EXPECT_EQ(std::size(pairs) + 1, static_cast<size_t>(v1::Reason_descriptor()->value_count()));
}

}  // namespace
}  // namespace dsg
