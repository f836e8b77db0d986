// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/sdf_world.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <numbers>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_replace.h"
#include "query/cli/export/outline.h"
#include "schema/picture/look.h"

namespace dsg::cli {
namespace {

static_assert(std::endian::native == std::endian::little, "STL is little endian");

// Simulators refuse boxes without a volume.
constexpr double kEdgeMinM = 0.01;
// Slabs have their upper side where the room begins.
constexpr double kSlabM = 0.1;
// The mesh of an object lies around its box by the size of a voxel or so.
constexpr double kObjectReachM = 0.05;
// Agents whose box is unknown: about a torso high and wide, or a small robot.
constexpr double kAgentHalfM = 0.25;
// Arms widen the box of a body, and its capsule has to pass doors.
constexpr double kAgentRadiusMaxM = 0.25;
// A capsule around a body has several times its volume.
constexpr double kHumanMassKg = 75.0;

// Letters that no reader of names takes for a separator.
std::string NameIn(const Node& node) {
  std::string name = ToString(node.id);
  const std::string& said = node.class_name.empty() ? node.name : node.class_name;
  if (!said.empty()) absl::StrAppend(&name, "_", said);
  for (char& letter : name) {
    if (!absl::ascii_isalnum(static_cast<unsigned char>(letter))) letter = '_';
  }
  return name;
}

// Names of files may have any letters.
std::string Escaped(const std::string& text) {
  return absl::StrReplaceAll(text, {{"&", "&amp;"}, {"<", "&lt;"}, {">", "&gt;"}});
}

std::string Numbers(const Eigen::Vector3d& values) {
  // Plus zero, which makes zero of minus zero.
  return absl::StrFormat("%.6f %.6f %.6f", values.x() + 0.0, values.y() + 0.0, values.z() + 0.0);
}

// Turns about the fixed axes x, y, z in this order, radians.
Eigen::Vector3d RollPitchYaw(const Eigen::Quaterniond& turn) {
  const Eigen::Matrix3d axes = turn.normalized().toRotationMatrix();
  const double pitch = std::asin(std::clamp(-axes(2, 0), -1.0, 1.0));
  // Straight up or down, roll and yaw are one turn.
  if (std::abs(axes(2, 0)) > 1.0 - 1e-9) {
    return {0.0, pitch, std::atan2(-axes(0, 1), axes(1, 1))};
  }
  return {std::atan2(axes(2, 1), axes(2, 2)), pitch, std::atan2(axes(1, 0), axes(0, 0))};
}

std::string PoseTag(const Pose3d& pose) {
  return absl::StrCat("<pose>", Numbers(pose.position), " ",
                      Numbers(RollPitchYaw(pose.orientation)), "</pose>");
}

std::string BoxTag(const Eigen::Vector3d& size_m) {
  return absl::StrCat("<box><size>", Numbers(size_m.cwiseMax(kEdgeMinM)), "</size></box>");
}

std::string MaterialTag(uint32_t rgb) {
  const auto share = [rgb](int shift) { return static_cast<double>(rgb >> shift & 0xff) / 255.0; };
  const std::string color = absl::StrFormat("%.3f %.3f %.3f 1", share(16), share(8), share(0));
  return absl::StrCat("<material><ambient>", color, "</ambient><diffuse>", color,
                      "</diffuse></material>");
}

std::string InertialTag(double mass_kg, const Eigen::Vector3d& moments) {
  return absl::StrFormat(
      "<inertial><mass>%.6g</mass><inertia><ixx>%.6g</ixx><ixy>0</ixy><ixz>0</ixz>"
      "<iyy>%.6g</iyy><iyz>0</iyz><izz>%.6g</izz></inertia></inertial>\n",
      mass_kg, moments.x(), moments.y(), moments.z());
}

// Of a solid box or, nearly, of what fills it.
std::string BoxInertia(const Eigen::Vector3d& size_m, double mass_kg) {
  const Eigen::Vector3d squares = size_m.cwiseAbs2();
  return InertialTag(mass_kg, mass_kg / 12.0 * (squares.sum() - squares.array()).matrix());
}

// What collides is what is seen. Siblings of any kind need names of their own.
std::string ShapeTags(const std::string& name, const Pose3d& pose, const std::string& geometry,
                      uint32_t rgb) {
  const std::string inside = absl::StrCat(PoseTag(pose), "<geometry>", geometry, "</geometry>");
  return absl::StrCat("<collision name='", name, "'>", inside, "</collision>\n<visual name='", name,
                      "_visual'>", inside, MaterialTag(rgb), "</visual>\n");
}

struct PosedBox {
  Pose3d map_T_box;
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();
};

// The node's box, around its own centre.
PosedBox BoxOf(const Node& node) {
  return {Pose3d{MiddleOf(node), node.map_T_node.orientation}, node.box_node.sizes()};
}

// The box of a wall that is not along the axes of its box stands for its diagonal.
PosedBox WallOf(const Node& node) {
  const std::vector<Eigen::Vector2d> line = SlantedWall(node);
  if (line.empty()) return BoxOf(node);
  const Box3d box_map = node.BoxMap();
  const Eigen::Vector2d along = line[1] - line[0];
  const Eigen::Vector2d middle = 0.5 * (line[0] + line[1]);
  PosedBox wall;
  wall.map_T_box.position = {middle.x(), middle.y(), box_map.center().z()};
  wall.map_T_box.orientation =
      Eigen::AngleAxisd(std::atan2(along.y(), along.x()), Eigen::Vector3d::UnitZ());
  wall.size_m = {along.norm(), kSlabM, box_map.sizes().z()};
  return wall;
}

// Below a room, over the box around its outline: rooms of one floor may overlap, gaps may not be.
PosedBox SlabOf(const Node& room, const Polygon2d& outline) {
  Eigen::AlignedBox2d area;
  for (const Eigen::Vector2d& corner : outline) area.extend(corner);
  const bool has_heights = room.region.has_value() && room.region->z_max_m > room.region->z_min_m;
  const double floor_m = has_heights ? room.region->z_min_m : room.BoxMap().min().z();
  PosedBox slab;
  slab.map_T_box.position = {area.center().x(), area.center().y(), floor_m - 0.5 * kSlabM};
  slab.size_m = {area.sizes().x(), area.sizes().y(), kSlabM};
  return slab;
}

class WorldMaker {
 public:
  WorldMaker(const MapContent& content, const SdfOptions& options)
      : content_(content), options_(options) {
    for (const Node& node : content.nodes) {
      if (node.kind == kinds::kObject && !node.box_node.isEmpty()) objects_.push_back(&node);
    }
  }

  SdfWorld Make() {
    std::string& xml = world_.xml;
    absl::StrAppend(&xml, "<?xml version='1.0'?>\n<sdf version='1.9'>\n<world name='",
                    content_.spec.name, "'>\n<gravity>0 0 -9.80665</gravity>\n",
                    "<light type='directional' name='sun'><cast_shadows>0</cast_shadows>",
                    "<diffuse>0.8 0.8 0.8 1</diffuse><direction>-0.4 0.3 -0.9</direction>",
                    "</light>\n");
    AddBuilding();
    for (const Node* object : objects_) AddObject(*object);
    if (options_.with_agents) {
      for (const Track& track : content_.tracks) AddAgent(track);
    }
    absl::StrAppend(&xml, "</world>\n</sdf>\n");
    return std::move(world_);
  }

 private:
  void AddBuilding() {
    std::string shapes;
    for (const Node& node : content_.nodes) {
      const Polygon2d outline = node.kind == kinds::kRoom ? FloorOutline(node) : Polygon2d();
      if (outline.size() < 3) continue;
      AddBox(ToString(node.id), SlabOf(node, outline), FloorColor(node), &shapes);
      ++world_.floor_count;
    }
    MakeStl();
    if (world_.face_count > 0) {
      absl::StrAppend(&shapes, ShapeTags("mesh", Pose3d(),
                                         absl::StrCat("<mesh><uri>", Escaped(options_.mesh_uri),
                                                      "</uri></mesh>"),
                                         kWallRgb));
    } else {
      AddStructures(&shapes);
    }
    if (shapes.empty()) return;
    absl::StrAppend(&world_.xml, "<model name='building'><static>true</static>\n",
                    "<link name='building'>\n", shapes, "</link>\n</model>\n");
  }

  static void AddBox(const std::string& name, const PosedBox& box, uint32_t rgb,
                     std::string* shapes) {
    absl::StrAppend(shapes, ShapeTags(name, box.map_T_box, BoxTag(box.size_m), rgb));
  }

  // Ceilings would hide all else.
  void AddStructures(std::string* shapes) {
    for (const Node& node : content_.nodes) {
      if (node.kind != kinds::kStructure || node.box_node.isEmpty()) continue;
      if (node.structure.has_value() && node.structure->structure_type == "ceiling") continue;
      AddBox(ToString(node.id), WallOf(node), kWallRgb, shapes);
      ++world_.wall_count;
    }
  }

  std::vector<const Node*> ObjectsNear(const MeshBlock& block) const {
    Box3d bounds;
    for (const Eigen::Vector3f& point : block.positions_map) bounds.extend(point.cast<double>());
    std::vector<const Node*> near;
    std::copy_if(objects_.begin(), objects_.end(), std::back_inserter(near),
                 [&](const Node* object) {
                   return bounds.exteriorDistance(object->BoxMap()) <= kObjectReachM;
                 });
    return near;
  }

  static bool IsInside(const std::vector<const Node*>& objects, const MeshBlock& block,
                       const std::array<uint32_t, 3>& face) {
    return std::any_of(objects.begin(), objects.end(), [&](const Node* object) {
      return std::all_of(face.begin(), face.end(), [&](uint32_t vertex) {
        return object->DistanceTo(block.positions_map[vertex].cast<double>()) <= kObjectReachM;
      });
    });
  }

  // 80 bytes of any text, the count of faces; of each its normal, its corners, and two bytes.
  void MakeStl() {
    constexpr size_t kHeadBytes = 80;
    std::string faces;
    const auto add = [&faces](const Eigen::Vector3f& values) {
      faces.append(reinterpret_cast<const char*>(values.data()), 3 * sizeof(float));
    };
    for (const MeshBlock& block : content_.mesh) {
      const std::vector<const Node*> near = ObjectsNear(block);
      for (const std::array<uint32_t, 3>& face : block.faces) {
        if (IsInside(near, block, face)) continue;
        const Eigen::Vector3f& a = block.positions_map[face[0]];
        const Eigen::Vector3f& b = block.positions_map[face[1]];
        const Eigen::Vector3f& c = block.positions_map[face[2]];
        for (const Eigen::Vector3f& values : {(b - a).cross(c - a).normalized().eval(), a, b, c}) {
          add(values);
        }
        faces.append(2, '\0');
        ++world_.face_count;
      }
    }
    if (world_.face_count == 0) return;
    const auto count = static_cast<uint32_t>(world_.face_count);
    world_.stl = absl::StrCat("map ", content_.spec.name, " revision ", content_.revision);
    world_.stl.resize(kHeadBytes, ' ');
    world_.stl.append(reinterpret_cast<const char*>(&count), sizeof(count));
    world_.stl += faces;
  }

  void AddModel(const Node& node, const Pose3d& pose, const std::string& model_tags,
                const std::string& link_tags) {
    const std::string name = NameIn(node);
    absl::StrAppend(&world_.xml, "<model name='", name, "'>", model_tags, PoseTag(pose),
                    "\n<link name='", name, "'>\n", link_tags, "</link>\n</model>\n");
  }

  void AddObject(const Node& node) {
    const PosedBox box = BoxOf(node);
    const Eigen::Vector3d size_m = box.size_m.cwiseMax(kEdgeMinM);
    const bool is_movable = size_m.maxCoeff() <= options_.movable_size_m;
    AddModel(node, box.map_T_box, is_movable ? "" : "<static>true</static>",
             absl::StrCat(BoxInertia(size_m, options_.density_kg_m3 * size_m.prod()),
                          ShapeTags("box", Pose3d(), BoxTag(size_m), ClassColor(node))));
    ++world_.object_count;
    if (is_movable) ++world_.movable_count;
  }

  void AddAgent(const Track& track) {
    const auto node = std::find_if(content_.nodes.begin(), content_.nodes.end(),
                                   [&](const Node& other) { return other.id == track.agent; });
    if (node == content_.nodes.end()) return;
    Box3d box = node->BoxMap();
    if (node->box_node.isEmpty()) {
      box = {box.center().array() - kAgentHalfM, box.center().array() + kAgentHalfM};
    }
    // The box says how far it reaches around the agent, the track where that is.
    const Eigen::Vector3d middle = LastOf(track) + box.center() - node->map_T_node.position;
    const Eigen::Vector3d size_m = box.sizes();
    const double radius_m =
        std::max(kEdgeMinM, std::min(kAgentRadiusMaxM, 0.5 * size_m.minCoeff()));
    const double length_m = std::max(kEdgeMinM, size_m.z() - 2.0 * radius_m);
    const double volume_m3 =
        std::numbers::pi * radius_m * radius_m * (length_m + 4.0 / 3.0 * radius_m);
    const double mass_kg =
        node->kind == kinds::kHuman ? kHumanMassKg : options_.density_kg_m3 * volume_m3;
    const std::string capsule = absl::StrFormat(
        "<capsule><radius>%.6f</radius><length>%.6f</length></capsule>", radius_m, length_m);
    const auto index = static_cast<size_t>(&track - content_.tracks.data());
    AddModel(*node, Pose3d{middle, Eigen::Quaterniond::Identity()}, "",
             absl::StrCat("<gravity>false</gravity><kinematic>true</kinematic>\n",
                          BoxInertia({2.0 * radius_m, 2.0 * radius_m, size_m.z()}, mass_kg),
                          ShapeTags("capsule", Pose3d(), capsule, AgentColor(index))));
    ++world_.agent_count;
  }

  const MapContent& content_;
  const SdfOptions& options_;
  std::vector<const Node*> objects_;
  SdfWorld world_;
};

}  // namespace

SdfWorld MakeSdf(const MapContent& content, const SdfOptions& options) {
  return WorldMaker(content, options).Make();
}

}  // namespace dsg::cli
