// SPDX-License-Identifier: Apache-2.0
// labels.csv: the classes of the label images, each with a colour of its own.
// Refuses classes that do not fit into a label image.
#pragma once

#include <string>
#include <vector>

#include "schema/model/layer.h"
#include "schema/model/node.h"

namespace dsg::simulator {

/// Of structures and objects; rooms and buildings have classes above, which no image shows.
inline constexpr int kSurfaceClassMax = 99;

/// Differs from class to class; black for 0. Requires: 0 <= class_id <= 255.
Color LabelColor(int class_id);

/// The columns of uHumans2: name,red,green,blue,alpha,id. Classes above 255 (rooms, buildings)
/// are left out. Order: ascending id.
std::string LabelTable(const std::vector<SemanticLabel>& labels);

}  // namespace dsg::simulator
