// SPDX-License-Identifier: Apache-2.0
// Label images in the colours of labels.csv.
// Refuses to guess the colour of a class that has none.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "ingest/log/label_table.h"
#include "ingest/sensor/image.h"

namespace dsg::simulator {

/// Red, green, blue of each class.
using LabelColors = std::array<std::optional<std::array<uint8_t, 3>>, 256>;

/// The first row of a class counts. Class 0, unknown, is black unless given. Classes beyond 255,
/// which no label image holds, are left out.
LabelColors ColorsOf(const ingest::LabelTable& table);

/// The classes of a label image as colours. `origin` is for messages.
///
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED for a class without a colour.
absl::StatusOr<ingest::Image> ColorLabels(const ingest::Image& labels, const LabelColors& colors,
                                          const std::string& origin);

}  // namespace dsg::simulator
