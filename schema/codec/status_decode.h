// SPDX-License-Identifier: Apache-2.0
// Turns the ending of a gRPC call back into the Status that the server made, for every client.
// Refuses to trust a detail that contradicts the status code it came with.
#pragma once

#include <string_view>

#include "absl/status/status.h"

namespace dsg {

/// The trailer that carries a serialized dsg.v1.ErrorDetail.
inline constexpr char kErrorTrailer[] = "dsg-error-bin";

/// `code` and `message` as gRPC reports them; `detail` is the trailer's bytes, empty if there was
/// none. A garbled or foreign detail, and a reason that this build does not know or that belongs to
/// another code, are left out: the error then has code and message only.
absl::Status DecodeStatus(int code, std::string_view message, std::string_view detail);

}  // namespace dsg
