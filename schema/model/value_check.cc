// SPDX-License-Identifier: Apache-2.0
#include "schema/model/value_check.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "schema/base/utf8.h"
#include "schema/model/delta_check.h"

namespace dsg::values {
absl::Status Invalid(std::string_view what, ErrorMetadata metadata) {
  return MakeError(Reason::kDeltaInvalid, absl::StrCat("delta refused: ", std::string(what)),
                   std::move(metadata));
}

absl::Status NotFinite(std::string_view what) {
  return MakeError(Reason::kNumberNotFinite,
                   absl::StrCat("delta refused: ", std::string(what),
                                " is not a finite number of at most ", kCoordinateMaxM));
}

bool IsSane(const Eigen::Vector3d& v) {
  return v.allFinite() && v.cwiseAbs().maxCoeff() <= kCoordinateMaxM;
}

bool AreSane(const std::vector<float>& numbers) {
  // Not-a-number is below nothing.
  return std::all_of(numbers.begin(), numbers.end(), [](float number) {
    return std::abs(static_cast<double>(number)) <= kCoordinateMaxM;
  });
}

absl::Status CheckText(std::string_view text, size_t length_max, What what) {
  if (text.size() > length_max) {
    return Invalid(
        absl::StrCat(what(), " has ", text.size(), " bytes; at most ", length_max, " are kept"));
  }
  if (!IsUtf8(text)) return Invalid(what() + " is not UTF-8; convert it");
  return absl::OkStatus();
}

absl::Status CheckPose(const Pose3d& pose, What what) {
  if (!IsSane(pose.position)) {
    return NotFinite(absl::StrCat("position (", pose.position.x(), ", ", pose.position.y(), ", ",
                                  pose.position.z(), ") of ", what()));
  }
  if (!IsValidPose(pose)) {
    return Invalid(absl::StrCat("orientation of ", what(), " has norm ", pose.orientation.norm(),
                                "; it must be a unit quaternion, normalise it"));
  }
  return absl::OkStatus();
}

absl::Status CheckBox(const Box3d& box, What what) {
  if (box.isEmpty()) return absl::OkStatus();
  if (!IsSane(box.min()) || !IsSane(box.max()))
    return NotFinite("a corner of the box of " + what());
  return absl::OkStatus();
}

absl::Status CheckInstant(TimeNs time_ns, What what) {
  if (time_ns != kTimeMin && time_ns != kTimeMax) return absl::OkStatus();
  return Invalid(absl::StrCat(what(), " is ", time_ns,
                              " ns, a limit of 64 bits, which means an open end; give an instant, "
                              "or leave it out"));
}

absl::Status CheckNotNegative(double number, What what) {
  if (number >= 0.0) return absl::OkStatus();
  return Invalid(absl::StrCat(what(), " is ", number, "; it must be 0 or more"));
}

absl::Status CheckRegion(const RegionInfo& region, What what) {
  for (const auto& [name, probability] : region.class_probabilities) {
    DSG_RETURN_IF_ERROR(CheckText(name, kNameLengthMax, [&] { return "a class of " + what(); }));
    if (!std::isfinite(probability)) return NotFinite("a class probability of " + what());
  }
  const Polygon2d& outline = region.footprint_map;
  if (outline.size() > 65536)
    return Invalid("footprint of " + what() + " has more than 65536 corners");
  for (const Eigen::Vector2d& corner : outline) {
    if (!IsSane({corner.x(), corner.y(), 0.0})) return NotFinite("footprint of " + what());
  }
  if (!outline.empty() && (outline.size() < 3 || SignedArea(outline) == 0.0)) {
    return Invalid(absl::StrCat("footprint of ", what(), " has ", outline.size(),
                                " corners and no area; give at least 3 that are not on a line, or "
                                "none if it is not known"));
  }
  if (!IsSane({region.z_min_m, region.z_max_m, 0.0})) {
    return NotFinite(
        absl::StrCat("height ", region.z_min_m, " or ", region.z_max_m, " of ", what()));
  }
  if (region.z_min_m <= region.z_max_m) return absl::OkStatus();
  return Invalid(absl::StrCat("footprint of ", what(), " is inverted: z_min_m ", region.z_min_m,
                              " is above z_max_m ", region.z_max_m, "; swap them"));
}

absl::Status CheckInterval(const Interval& interval, What what) {
  if (interval.from_ns < interval.to_ns) return absl::OkStatus();
  return Invalid(absl::StrCat("validity [", interval.from_ns, ", ", interval.to_ns, ") of ", what(),
                              " is empty; from must be before to"));
}

absl::Status CheckAttributes(const Attributes& attributes, What what) {
  if (attributes.size() > kAttributeCountMax) {
    return Invalid(absl::StrCat(what(), " has ", attributes.size(), " attributes; at most ",
                                kAttributeCountMax, " are kept"));
  }
  for (const auto& [name, value] : attributes) {
    const auto* text = std::get_if<std::string>(&value);
    const auto* number = std::get_if<double>(&value);
    if (name.empty() || name.size() > kNameLengthMax ||
        (text != nullptr && text->size() > kAttributeLengthMax)) {
      return Invalid(absl::StrCat("attribute \"", name.substr(0, 64), "\" of ", what(),
                                  " is empty or too long"));
    }
    if (!IsUtf8(name) || (text != nullptr && !IsUtf8(*text))) {
      return Invalid(absl::StrCat("an attribute of ", what(), " is not UTF-8; convert it"));
    }
    if (number != nullptr && !std::isfinite(*number)) {
      return NotFinite(absl::StrCat("attribute \"", name, "\" of ", what()));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckMeshBlock(const MeshBlock& block) {
  const auto what = [&] {
    return absl::StrCat("mesh block ", block.index.x, ",", block.index.y, ",", block.index.z);
  };
  const size_t count = block.positions_map.size();
  if (count > kMeshVertexCountMax || block.faces.size() > 2 * kMeshVertexCountMax) {
    return Invalid(what() + " has too many vertices or faces");
  }
  const auto fits = [count](size_t size) { return size == 0 || size == count; };
  if (!fits(block.normals_map.size()) || !fits(block.colors.size()) || !fits(block.labels.size()) ||
      !fits(block.instance_ids.size()) || !fits(block.first_seen_ns.size()) ||
      !fits(block.last_seen_ns.size())) {
    return Invalid(what() + " has a channel that is not as long as its positions");
  }
  for (const auto& position : block.positions_map) {
    if (!IsSane(position.cast<double>())) return NotFinite("a vertex of " + what());
  }
  for (const auto& normal : block.normals_map) {
    if (!normal.allFinite()) return NotFinite("a normal of " + what());
  }
  for (const auto& face : block.faces) {
    if (*std::max_element(face.begin(), face.end()) >= count) {
      return Invalid(what() + " has a face with a vertex that does not exist");
    }
  }
  return absl::OkStatus();
}

}  // namespace dsg::values
