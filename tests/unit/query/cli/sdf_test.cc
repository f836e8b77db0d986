// SPDX-License-Identifier: Apache-2.0
// A world for physics simulators, read back with a reader of XML: what it has, where and how large.
#include <gtest/gtest.h>

#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>
#include <cstring>
#include <map>
#include <random>
#include <set>
#include <sstream>

#include "query/cli/export/sdf_world.h"
#include "tests/unit/query/cli/cli_test_util.h"
#include "tests/unit/query/cli/example_content.h"

namespace dsg::cli {
namespace {

using Tree = boost::property_tree::ptree;
using Children = std::map<std::string, Tree>;

constexpr double kWrittenM = 1e-6;

std::vector<double> NumbersOf(const std::string& text) {
  std::istringstream in(text);
  return {std::istream_iterator<double>(in), std::istream_iterator<double>()};
}

Eigen::Vector3d VectorOf(const std::string& text) {
  const std::vector<double> numbers = NumbersOf(text);
  EXPECT_EQ(numbers.size(), 3u) << text;
  return numbers.size() == 3 ? Eigen::Vector3d(numbers[0], numbers[1], numbers[2])
                             : Eigen::Vector3d::Zero();
}

// As SDFormat defines it: turned about the fixed x, then y, then z.
Pose3d PoseOf(const Tree& tree) {
  const std::vector<double> numbers = NumbersOf(tree.get<std::string>("pose"));
  EXPECT_EQ(numbers.size(), 6u);
  if (numbers.size() != 6) return {};
  Pose3d pose;
  pose.position = {numbers[0], numbers[1], numbers[2]};
  pose.orientation = Eigen::AngleAxisd(numbers[5], Eigen::Vector3d::UnitZ()) *
                     Eigen::AngleAxisd(numbers[4], Eigen::Vector3d::UnitY()) *
                     Eigen::AngleAxisd(numbers[3], Eigen::Vector3d::UnitX());
  return pose;
}

// Those of a tag by their names, which differ.
Children NamedChildren(const Tree& tree, const std::string& tag) {
  Children children;
  for (const auto& [key, child] : tree) {
    if (key != tag) continue;
    const auto name = child.get<std::string>("<xmlattr>.name");
    EXPECT_TRUE(children.emplace(name, child).second) << name << " is there twice";
  }
  return children;
}

struct ReadWorld {
  std::string name;
  Children models;
  /// Collisions of the building.
  Children building;
};

ReadWorld Read(const SdfWorld& world) {
  Tree tree;
  std::istringstream in(world.xml);
  boost::property_tree::read_xml(in, tree);
  EXPECT_EQ(tree.get<std::string>("sdf.<xmlattr>.version"), "1.9");
  const Tree& root = tree.get_child("sdf.world");
  ReadWorld read{root.get<std::string>("<xmlattr>.name"), NamedChildren(root, "model"), {}};
  const auto building = read.models.find("building");
  if (building != read.models.end()) {
    EXPECT_TRUE(building->second.get<bool>("static"));
    read.building = NamedChildren(building->second.get_child("link"), "collision");
    read.models.erase(building);
  }
  return read;
}

Eigen::Vector3d BoxSize(const Tree& collision) {
  return VectorOf(collision.get<std::string>("geometry.box.size"));
}

MapContent WithoutMesh() {
  MapContent content = test::ExampleContent();
  content.mesh.clear();
  return content;
}

TEST(SdfWorld, HasFloorsWallsAndObjectsWhereTheMapHasThem) {
  const SdfWorld world = MakeSdf(WithoutMesh(), {});
  const ReadWorld read = Read(world);
  EXPECT_EQ(read.name, "example");
  EXPECT_TRUE(world.stl.empty());
  ASSERT_EQ(read.building.size(), 3u);
  EXPECT_EQ(world.floor_count, 2u);
  EXPECT_EQ(world.wall_count, 1u);
  // The floor of the square room is at z = 0.
  const Tree& floor = read.building.at("R1");
  EXPECT_LT((PoseOf(floor).position - Eigen::Vector3d(2, 2, -0.05)).norm(), kWrittenM);
  EXPECT_LT((BoxSize(floor) - Eigen::Vector3d(4, 4, 0.1)).norm(), kWrittenM);
  // A wall without thickness has one here.
  const Tree& wall = read.building.at("W1");
  EXPECT_LT((PoseOf(wall).position - Eigen::Vector3d(4, 2, 1.5)).norm(), kWrittenM);
  EXPECT_LT((BoxSize(wall) - Eigen::Vector3d(0.01, 4, 3)).norm(), kWrittenM);
  ASSERT_EQ(read.models.size(), 1u);
  const Tree& chair = read.models.at("O1_chair");
  EXPECT_TRUE(chair.get<bool>("static"));
  EXPECT_LT((PoseOf(chair).position - Eigen::Vector3d(1, 1, 0.5)).norm(), kWrittenM);
  EXPECT_NEAR(AngleBetween(PoseOf(chair).orientation, Eigen::Quaterniond(Eigen::AngleAxisd(
                                                          M_PI / 6.0, Eigen::Vector3d::UnitZ()))),
              0.0, 1e-5);
  EXPECT_LT((BoxSize(chair.get_child("link.collision")) - Eigen::Vector3d(0.5, 1, 1)).norm(),
            kWrittenM);
}

TEST(SdfWorld, MovesObjectsUpToASizeWithTheMassOfTheirBoxes) {
  const SdfWorld world = MakeSdf(WithoutMesh(), {.movable_size_m = 1.0, .density_kg_m3 = 120.0});
  EXPECT_EQ(world.movable_count, 1u);
  const Tree chair = Read(world).models.at("O1_chair");
  EXPECT_FALSE(chair.get_optional<bool>("static").has_value());
  const Tree& inertial = chair.get_child("link.inertial");
  const double mass_kg = 120.0 * 0.5 * 1.0 * 1.0;
  EXPECT_NEAR(inertial.get<double>("mass"), mass_kg, 1e-3);
  EXPECT_NEAR(inertial.get<double>("inertia.ixx"), mass_kg / 12.0 * 2.0, 1e-3);
  EXPECT_NEAR(inertial.get<double>("inertia.iyy"), mass_kg / 12.0 * 1.25, 1e-3);
  EXPECT_NEAR(inertial.get<double>("inertia.izz"), mass_kg / 12.0 * 1.25, 1e-3);
}

TEST(SdfWorld, TurnsAnyObjectAsTheMapDoes) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  MapContent content;
  content.spec.name = "turned";
  for (uint64_t i = 0; i < 200; ++i) {
    Node node = test::MakeNode(NodeId('O', i), kinds::kObject, "<a & 'b'>",
                               {10 * share(random), 10 * share(random), share(random)});
    // Boxes need not be around the origin of their node.
    node.box_node = Box3d(Eigen::Vector3d::Zero(), Eigen::Vector3d(0.2, 0.3, 0.1 + share(random)));
    if (node.box_node.isEmpty()) node.box_node.max().z() = 0.4;
    node.map_T_node.orientation = Eigen::Quaterniond::UnitRandom();
    if (i % 10 == 0) {
      node.map_T_node.orientation =
          Eigen::AngleAxisd(share(random), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(i % 20 == 0 ? M_PI / 2 : -M_PI / 2, Eigen::Vector3d::UnitY());
    }
    content.nodes.push_back(node);
  }
  const ReadWorld read = Read(MakeSdf(content, {}));
  ASSERT_EQ(read.models.size(), content.nodes.size());
  for (const Node& node : content.nodes) {
    const auto model = std::find_if(read.models.begin(), read.models.end(), [&](const auto& entry) {
      return entry.first.starts_with(ToString(node.id) + "_");
    });
    ASSERT_NE(model, read.models.end());
    const Pose3d pose = PoseOf(model->second);
    EXPECT_LT((pose.position - MiddleOf(node)).norm(), 1e-5) << ToString(node.id);
    EXPECT_NEAR(AngleBetween(pose.orientation, node.map_T_node.orientation), 0.0, 1e-4)
        << ToString(node.id);
    const Eigen::Vector3d size_m = BoxSize(model->second.get_child("link.collision"));
    EXPECT_LT((size_m - node.box_node.sizes().cwiseMax(0.01)).norm(), kWrittenM);
  }
}

TEST(SdfWorld, LaysSlantedWallsAlongThemselves) {
  MapContent content;
  content.spec.name = "slanted";
  Node wall = test::MakeNode(NodeId('W', 7), kinds::kStructure, "", {2, 1, 1.5});
  // From (0, 0) to (4, 2).
  wall.structure = StructureInfo{"wall", Eigen::Vector3d(-1, 2, 0).normalized(), 0.0, 0};
  wall.box_node = Box3d(Eigen::Vector3d(-2, -1, -1.5), Eigen::Vector3d(2, 1, 1.5));
  content.nodes = {wall};
  const Tree shape = Read(MakeSdf(content, {})).building.at("W7");
  const Eigen::Vector3d along = PoseOf(shape).orientation * Eigen::Vector3d::UnitX();
  EXPECT_NEAR(std::abs(along.dot(Eigen::Vector3d(2, 1, 0).normalized())), 1.0, 1e-6);
  EXPECT_LT((PoseOf(shape).position - Eigen::Vector3d(2, 1, 1.5)).norm(), kWrittenM);
  EXPECT_LT((BoxSize(shape) - Eigen::Vector3d(std::sqrt(20.0), 0.1, 3)).norm(), 1e-5);
}

TEST(SdfWorld, CollidesWithTheMeshButNotWhereObjectsAre) {
  MapContent content = test::ExampleContent();
  // The seat of the chair, which its box stands for.
  MeshBlock seat;
  seat.index = {0, 0, 1};
  seat.positions_map = {{0.9f, 0.9f, 0.5f}, {1.1f, 0.9f, 0.5f}, {1.0f, 1.1f, 0.5f}};
  seat.faces = {{0, 1, 2}};
  content.mesh.push_back(seat);
  const SdfWorld world = MakeSdf(content, {.mesh_uri = "example.stl"});
  const ReadWorld read = Read(world);
  // Doors are holes of the mesh, and boxes of walls would close them.
  EXPECT_FALSE(read.building.contains("W1"));
  EXPECT_TRUE(read.building.contains("R1"));
  EXPECT_EQ(read.building.at("mesh").get<std::string>("geometry.mesh.uri"), "example.stl");
  ASSERT_EQ(world.face_count, 4u);
  ASSERT_EQ(world.stl.size(), 84u + 50u * 4u);
  uint32_t count = 0;
  std::memcpy(&count, world.stl.data() + 80, sizeof(count));
  EXPECT_EQ(count, 4u);
  size_t at = 84;
  for (const MeshBlock& block : test::ExampleContent().mesh) {
    for (const auto& face : block.faces) {
      // A column each for the normal and the corners.
      Eigen::Matrix<float, 3, 4> written;
      std::memcpy(written.data(), world.stl.data() + at, 12 * sizeof(float));
      EXPECT_EQ(written.col(0), Eigen::Vector3f(0, 0, 1));
      for (int i = 0; i < 3; ++i) {
        EXPECT_EQ(written.col(i + 1), block.positions_map[face[static_cast<size_t>(i)]]);
      }
      at += 50;
    }
  }
}

TEST(SdfWorld, StandsAgentsWhereTheirTracksEnd) {
  MapContent content = WithoutMesh();
  EXPECT_EQ(Read(MakeSdf(content, {})).models.count("H1_ada"), 0u);
  // A body 1.7 m high, seen from its torso.
  content.nodes[0].box_node =
      Box3d(Eigen::Vector3d(-0.2, -0.5, -1.0), Eigen::Vector3d(0.2, 0.5, 0.7));
  const SdfWorld world = MakeSdf(content, {.with_agents = true});
  EXPECT_EQ(world.agent_count, 1u);
  const Tree ada = Read(world).models.at("H1_ada");
  EXPECT_LT((PoseOf(ada).position - Eigen::Vector3d(7, 3, 0.85)).norm(), kWrittenM);
  EXPECT_TRUE(ada.get<bool>("link.kinematic"));
  EXPECT_FALSE(ada.get<bool>("link.gravity"));
  const Tree& capsule = ada.get_child("link.collision.geometry.capsule");
  EXPECT_NEAR(capsule.get<double>("radius"), 0.2, kWrittenM);
  EXPECT_NEAR(capsule.get<double>("length"), 1.3, kWrittenM);
  EXPECT_NEAR(ada.get<double>("link.inertial.mass"), 75.0, kWrittenM);
  // A robot weighs what a box of its volume does.
  content.nodes[0].kind = kinds::kRobot;
  const double volume_m3 = M_PI * 0.04 * (1.3 + 4.0 / 3.0 * 0.2);
  const SdfWorld robots = MakeSdf(content, {.density_kg_m3 = 300.0, .with_agents = true});
  EXPECT_NEAR(Read(robots).models.at("H1_ada").get<double>("link.inertial.mass"), 300.0 * volume_m3,
              0.01);
}

TEST(SdfWorld, OfAnEmptyMapIsAnEmptyWorld) {
  MapContent content;
  content.spec.name = "empty";
  const ReadWorld read = Read(MakeSdf(content, {.with_agents = true}));
  EXPECT_EQ(read.name, "empty");
  EXPECT_TRUE(read.models.empty());
}

}  // namespace
}  // namespace dsg::cli
