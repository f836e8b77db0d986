// SPDX-License-Identifier: Apache-2.0
// Tags of a map in words, for errors about one that is not there.
// Refuses to list thousands: nobody reads them.
#pragma once

#include <string>
#include <vector>

#include "schema/store/map_writer.h"

namespace dsg {

/// "autumn, spring and 3 more"; "none".
std::string TagNames(const std::vector<Tag>& tags);

}  // namespace dsg
