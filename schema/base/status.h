// SPDX-License-Identifier: Apache-2.0
// Errors as values: absl::Status with a machine-readable reason and metadata. Independent of gRPC
// and protobuf; the numbers equal those of dsg.v1.Reason, which a test checks.
#pragma once

#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace dsg {

/// Why a call failed, where a caller can act on it. Same numbers as dsg.v1.Reason.
enum class Reason {
  kUnspecified = 0,
  kFieldInvalid = 1,
  kMapNameInvalid = 2,
  kNodeIdInvalid = 3,
  kTimeRangeInverted = 4,
  kBoxInverted = 5,
  kNumberNotFinite = 6,
  kPageTokenMismatch = 7,
  kDeltaInvalid = 8,
  kFileMalformed = 9,
  kQueryMalformed = 10,
  kTimeImplausible = 11,
  kMapUnknown = 20,
  kNodeUnknown = 21,
  kAgentUnknown = 22,
  kLayerUnknown = 23,
  kAssetUnknown = 24,
  kClassUnknown = 25,
  kRelationUnknown = 26,
  kNoPath = 27,
  kTagUnknown = 28,
  kNoRegistration = 29,
  kTimeOutsideTrack = 40,
  kRevisionInFuture = 41,
  kRevisionCompacted = 42,
  kTimeOutsideMap = 43,
  kMapExists = 60,
  kTrackConflict = 61,
  kSequenceReused = 62,
  kFormatTooNew = 80,
  kFormatTooOld = 81,
  kNotAStore = 82,
  kNetworkFileSystem = 83,
  kReadOnly = 84,
  kPolicyMatchesAll = 85,
  kFramesIncompatible = 86,
  kPolicyTakesTooMuch = 87,
  kParentRevisionStale = 100,
  kSequenceGap = 101,
  kMapReplaced = 102,
  kWriterLocked = 120,
  kShuttingDown = 121,
  kCommitOutcomeUnknown = 122,
  kOverloaded = 140,
  kDiskFull = 141,
  kLimitExceeded = 142,
  kQuotaExceeded = 143,
  kStoreCorrupt = 160,
};

using ErrorMetadata = std::map<std::string, std::string>;

/// Makes an error. `message` says what failed, for which object and value, and what to do. The
/// reason determines the status code.
absl::Status MakeError(Reason reason, std::string_view message, ErrorMetadata metadata = {});

/// The status code of `reason`.
absl::StatusCode CodeOf(Reason reason);

/// The reason of an error; kUnspecified for OK and for errors without a reason.
Reason ReasonOf(const absl::Status& status);

/// The metadata of an error; empty for OK and for errors without a reason.
ErrorMetadata MetadataOf(const absl::Status& status);

/// The same error with "`context`: " before its message.
absl::Status Annotate(const absl::Status& status, std::string_view context);

}  // namespace dsg

#define DSG_CONCAT_INNER_(a, b) a##b
#define DSG_CONCAT_(a, b) DSG_CONCAT_INNER_(a, b)

/// Returns from the enclosing function if `expr` is not OK.
#define DSG_RETURN_IF_ERROR(expr)                               \
  do {                                                          \
    if (absl::Status dsg_status_ = (expr); !dsg_status_.ok()) { \
      return dsg_status_;                                       \
    }                                                           \
  } while (false)

#define DSG_ASSIGN_OR_RETURN_IMPL_(result, lhs, expr) \
  auto result = (expr);                               \
  if (!result.ok()) {                                 \
    return result.status();                           \
  }                                                   \
  lhs = *std::move(result)

/// Assigns the value of a StatusOr, or returns its error from the enclosing function.
#define DSG_ASSIGN_OR_RETURN(lhs, expr) \
  DSG_ASSIGN_OR_RETURN_IMPL_(DSG_CONCAT_(dsg_result_, __LINE__), lhs, expr)
