// SPDX-License-Identifier: Apache-2.0
// Says errors in the words of the command line: the services name fields, people typed options.
// Refuses to touch a message that names no field.
#pragma once

#include "absl/status/status.h"

namespace dsg::cli {

/// The same error, with options instead of fields, and with the verb that lists what there is where
/// something is unknown. Code, reason and metadata stay.
absl::Status InFlags(const absl::Status& status);

}  // namespace dsg::cli
