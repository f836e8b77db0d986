// SPDX-License-Identifier: Apache-2.0
// A .glb file keeps the rules of the format (glTF 2.0, sections 3.6, 3.7, 4.4) and tells the map.
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "query/cli/export/gltf_bodies.h"
#include "query/cli/export/gltf_scene.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/query/cli/example_content.h"

namespace dsg::cli {
namespace {

using Json = nlohmann::json;

uint32_t WordAt(const std::string& bytes, size_t at) {
  uint32_t word = 0;
  if (at + 4 <= bytes.size()) std::memcpy(&word, bytes.data() + at, 4);
  return word;
}

struct Glb {
  Json json;
  std::string binary;

  const Json* Find(const std::string& name) const {
    for (const Json& node : json["nodes"]) {
      if (node["name"] == name) return &node;
    }
    return nullptr;
  }
  template <class T>
  std::vector<T> Values(const Json& accessor) const {
    const Json& view = json["bufferViews"][accessor["bufferView"].get<size_t>()];
    std::vector<T> values(view["byteLength"].get<size_t>() / sizeof(T));
    std::memcpy(values.data(), binary.data() + view["byteOffset"].get<size_t>(),
                values.size() * sizeof(T));
    return values;
  }
};

// Splits the file into its chunks and checks their frame.
Glb ParseGlb(const std::string& bytes) {
  Glb glb;
  EXPECT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(WordAt(bytes, 4), 2u);
  EXPECT_EQ(WordAt(bytes, 8), bytes.size());
  const size_t json_size = WordAt(bytes, 12);
  EXPECT_EQ(bytes.substr(16, 4), "JSON");
  EXPECT_EQ(json_size % 4, 0u);
  glb.json = Json::parse(bytes.substr(20, json_size), nullptr, false);
  EXPECT_FALSE(glb.json.is_discarded());
  const size_t at = 20 + json_size;
  if (at == bytes.size()) return glb;
  EXPECT_EQ(WordAt(bytes, at) + at + 8, bytes.size());
  EXPECT_EQ(bytes.substr(at + 4, 4), std::string("BIN\0", 4));
  glb.binary = bytes.substr(at + 8);
  return glb;
}

size_t ComponentCount(const std::string& type) {
  return type == "SCALAR" ? 1 : type == "VEC3" ? 3 : 4;
}

// Each accessor fits its view, is aligned, and positions say their bounds.
void CheckAccessors(const Glb& glb) {
  if (glb.json.contains("buffers")) {
    EXPECT_EQ(glb.json["buffers"][0]["byteLength"], glb.binary.size());
  }
  for (const Json& accessor : glb.json.value("accessors", Json::array())) {
    const Json& view = glb.json["bufferViews"][accessor["bufferView"].get<size_t>()];
    const size_t component_bytes = accessor["componentType"] == 5123 ? 2 : 4;
    const size_t bytes =
        accessor["count"].get<size_t>() * component_bytes * ComponentCount(accessor["type"]);
    EXPECT_GT(bytes, 0u);
    EXPECT_EQ(view["byteLength"], bytes);
    EXPECT_EQ(view["byteOffset"].get<size_t>() % 4, 0u);
    EXPECT_LE(view["byteOffset"].get<size_t>() + bytes, glb.binary.size());
  }
}

void CheckBounds(const Glb& glb, const Json& accessor) {
  const std::vector<float> values = glb.Values<float>(accessor);
  std::array<float, 3> low{values[0], values[1], values[2]};
  std::array<float, 3> high = low;
  for (size_t i = 0; i < values.size(); ++i) {
    low[i % 3] = std::min(low[i % 3], values[i]);
    high[i % 3] = std::max(high[i % 3], values[i]);
  }
  EXPECT_EQ((accessor["min"].get<std::array<float, 3>>()), low);
  EXPECT_EQ((accessor["max"].get<std::array<float, 3>>()), high);
}

void CheckPrimitives(const Glb& glb) {
  for (const Json& mesh : glb.json.value("meshes", Json::array())) {
    for (const Json& primitive : mesh["primitives"]) {
      const Json& accessors = glb.json["accessors"];
      const Json& positions = accessors[primitive["attributes"]["POSITION"].get<size_t>()];
      CheckBounds(glb, positions);
      for (const Json& attribute : primitive["attributes"]) {
        EXPECT_EQ(accessors[attribute.get<size_t>()]["count"], positions["count"]);
      }
      const auto indices = glb.Values<uint32_t>(accessors[primitive["indices"].get<size_t>()]);
      for (const uint32_t index : indices) EXPECT_LT(index, positions["count"].get<size_t>());
      EXPECT_EQ(indices.size() % (primitive["mode"] == 1 ? 2 : 3), 0u);
      EXPECT_LT(primitive["material"], glb.json["materials"].size());
    }
  }
}

// Every node has one parent, or is the one at the top.
void CheckTree(const Glb& glb) {
  std::vector<int> parent_count(glb.json["nodes"].size(), 0);
  for (const Json& node : glb.json["nodes"]) {
    for (const size_t child : node.value("children", std::vector<size_t>())) ++parent_count[child];
  }
  EXPECT_EQ(glb.json["scenes"][0]["nodes"], Json({0}));
  for (size_t i = 0; i < parent_count.size(); ++i) EXPECT_EQ(parent_count[i], i == 0 ? 0 : 1) << i;
}

class GltfTest : public testing::Test {
 protected:
  Glb Export(const MapContent& content, size_t vertex_count_max = kPrimitiveVertexCountMax) {
    const std::string path = folder_.path() + "/a.glb";
    auto file = AtomicFile::Create(path, true);
    EXPECT_TRUE(file.ok());
    const GltfDocument document = MakeGltf(content, MeshColor::kAuto, vertex_count_max);
    EXPECT_TRUE(document.Write(&*file).ok() && file->Commit().ok());
    std::ifstream in(path, std::ios::binary);
    const Glb glb = ParseGlb(std::string{std::istreambuf_iterator<char>(in), {}});
    EXPECT_EQ(glb.json["asset"]["version"], "2.0");
    CheckAccessors(glb);
    CheckPrimitives(glb);
    CheckTree(glb);
    return glb;
  }

  dsg::test::TempFolder folder_;
};

TEST_F(GltfTest, KeepsNamesInAnyScriptAndSaysWhatNodesAre) {
  const Glb glb = Export(test::ExampleContent());
  const Json* room = glb.Find("Küche \"Süd\"");
  ASSERT_NE(room, nullptr);
  EXPECT_EQ((*room)["extras"],
            Json({{"id", "R1"}, {"kind", "room"}, {"layer", "rooms"}, {"class", "kitchen"}}));
  EXPECT_NE(glb.Find("chair\n1"), nullptr);
  // A node without a name goes by its id.
  EXPECT_NE(glb.Find("p2"), nullptr);
  for (const char* name : {"mesh", "places", "rooms", "TRAVERSABLE", "CONTAINS", "ada track"}) {
    EXPECT_NE(glb.Find(name), nullptr) << name;
  }
}

// A tetrahedron about the agent, which is at `x`; taller with time.
Body BodyOf(TimeNs time_ns, float x, const std::shared_ptr<const BodyFaces>& faces) {
  Body body;
  body.time_ns = time_ns;
  body.map_T_agent.position = Eigen::Vector3d(static_cast<double>(x), 2.0, 1.0);
  const float top = 1.0f + 0.5f * static_cast<float>(time_ns) / kNsPerSecond;
  body.points_map = {{x, 2, 0}, {x + 1, 2, 0}, {x, 3, 0}, {x, 2, top}};
  body.faces = faces;
  return body;
}

// Bodies a second apart from 1 s on; one pose leads to the next if `gap_s` is at least 1.
MapContent WithBodies(int count, double gap_s) {
  MapContent content = test::ExampleContent();
  content.spec.gap_ns_max = static_cast<TimeNs>(gap_s * kNsPerSecond);
  const auto faces =
      std::make_shared<const BodyFaces>(BodyFaces{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}});
  AgentBodies bodies{.agent = NodeId('H', 1), .rgb = 0x336699, .bodies = {}};
  for (int i = 1; i <= count; ++i) {
    bodies.bodies.push_back(BodyOf(i * kNsPerSecond, static_cast<float>(i), faces));
  }
  content.bodies = {bodies};
  return content;
}

// Plays the animation: where the body is drawn at a time, or nothing where all are hidden.
class Player {
 public:
  explicit Player(const Glb& glb) : glb_(glb) {}

  std::vector<Eigen::Vector3f> PointsAt(float time_s) const {
    std::vector<Eigen::Vector3f> shown;
    for (size_t node = 0; node < glb_.json["nodes"].size(); ++node) {
      if (!std::string(glb_.json["nodes"][node]["name"]).starts_with("ada body")) continue;
      if (Sampled(node, "scale", time_s).front() < 0.5f) continue;
      EXPECT_TRUE(shown.empty()) << "two bodies at " << time_s;
      shown = PointsOf(node, time_s);
    }
    return shown;
  }

 private:
  const Json& Accessor(const Json& index) const {
    return glb_.json["accessors"][index.get<size_t>()];
  }

  // The value of a property; empty where it is not animated.
  std::vector<float> Sampled(size_t node, const std::string& path, float time_s) const {
    const Json& animation = glb_.json["animations"][0];
    for (const Json& channel : animation["channels"]) {
      if (channel["target"]["node"] != node || channel["target"]["path"] != path) continue;
      const Json& sampler = animation["samplers"][channel["sampler"].get<size_t>()];
      const auto times = glb_.Values<float>(Accessor(sampler["input"]));
      const auto values = glb_.Values<float>(Accessor(sampler["output"]));
      const size_t width = values.size() / times.size();
      size_t after = 0;
      while (after < times.size() && times[after] <= time_s) ++after;
      const size_t before = after == 0 ? 0 : after - 1;
      after = std::min(after, times.size() - 1);
      const bool holds = sampler["interpolation"] == "STEP" || after == before;
      const float part = holds ? 0.0f : (time_s - times[before]) / (times[after] - times[before]);
      std::vector<float> value;
      for (size_t i = 0; i < width; ++i) {
        const float a = values[before * width + i];
        value.push_back(a + part * (values[after * width + i] - a));
      }
      return value;
    }
    return {};
  }

  std::vector<Eigen::Vector3f> PointsOf(size_t node, float time_s) const {
    const Json& json = glb_.json["nodes"][node];
    const Json& mesh = glb_.json["meshes"][json["mesh"].get<size_t>()];
    const Json& skin = mesh["primitives"][0];
    auto numbers = glb_.Values<float>(Accessor(skin["attributes"]["POSITION"]));
    const std::vector<float> weights = Sampled(node, "weights", time_s);
    for (size_t target = 0; target < weights.size(); ++target) {
      const auto moved = glb_.Values<float>(Accessor(skin["targets"][target]["POSITION"]));
      for (size_t i = 0; i < numbers.size(); ++i) numbers[i] += weights[target] * moved[i];
    }
    auto place = Sampled(node, "translation", time_s);
    if (place.empty()) place = json["translation"].get<std::vector<float>>();
    std::vector<Eigen::Vector3f> points;
    for (size_t i = 0; i < numbers.size(); i += 3) {
      points.emplace_back(numbers[i] + place[0], numbers[i + 1] + place[1],
                          numbers[i + 2] + place[2]);
    }
    return points;
  }

  const Glb& glb_;
};

TEST_F(GltfTest, LetsBodiesWalk) {
  constexpr int kCount = 2 * static_cast<int>(kPosesPerNode) + 5;
  const MapContent content = WithBodies(kCount, 1.0);
  const Glb glb = Export(content);
  const Player player(glb);
  const std::vector<Body>& bodies = content.bodies[0].bodies;
  for (size_t i = 0; i + 1 < bodies.size(); ++i) {
    // On a pose, and half way to the next.
    for (const float share : {0.0f, 0.5f}) {
      const auto points = player.PointsAt(static_cast<float>(i) + share);
      ASSERT_EQ(points.size(), 4U) << i;
      for (size_t v = 0; v < points.size(); ++v) {
        const Eigen::Vector3f due = bodies[i].points_map[v] +
                                    share * (bodies[i + 1].points_map[v] - bodies[i].points_map[v]);
        EXPECT_LT((points[v] - due).norm(), 1e-3f) << i << " " << share;
      }
    }
  }
  EXPECT_TRUE(player.PointsAt(static_cast<float>(kCount)).empty());
  EXPECT_NE(glb.Find("ada body 3"), nullptr);
  EXPECT_EQ(glb.Find("ada body 4"), nullptr);
}

TEST_F(GltfTest, ShowsNoBodyInAGapOfItsTrack) {
  const Glb glb = Export(WithBodies(3, 0.5));
  const Player player(glb);
  EXPECT_EQ(player.PointsAt(1.0f).size(), 4U);
  EXPECT_TRUE(player.PointsAt(1.6f).empty());
}

TEST_F(GltfTest, LetsOneBodyStand) {
  const Glb glb = Export(WithBodies(1, 1.0));
  EXPECT_FALSE(glb.json.contains("animations"));
  const Json* body = glb.Find("ada body");
  ASSERT_NE(body, nullptr);
  EXPECT_EQ((*body)["translation"], Json({1.0, 2.0, 1.0}));
  EXPECT_FALSE(body->contains("scale"));
  EXPECT_FALSE(Export(test::ExampleContent()).json.contains("animations"));
}

TEST_F(GltfTest, TurnsTheMapsZUp) {
  const Glb glb = Export(test::ExampleContent());
  const auto q = glb.json["nodes"][0]["rotation"].get<std::array<double, 4>>();
  const Eigen::Quaterniond y_up_T_map(q[3], q[0], q[1], q[2]);
  EXPECT_LT((y_up_T_map * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitY()).norm(), 1e-9);
  EXPECT_LT((y_up_T_map * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitX()).norm(), 1e-9);
}

TEST_F(GltfTest, PutsObjectsWhereTheyAre) {
  const Glb glb = Export(test::ExampleContent());
  const Json& chair = *glb.Find("chair\n1");
  EXPECT_EQ(chair["translation"], Json({1.0, 1.0, 0.5}));
  EXPECT_EQ(chair["scale"], Json({0.5, 1.0, 1.0}));
  EXPECT_NEAR(chair["rotation"][2].get<double>(), std::sin(M_PI / 12.0), 1e-12);
  // The wall is a plane; a size of zero would leave its matrix without an inverse.
  EXPECT_GT((*glb.Find("W1"))["scale"][0].get<double>(), 0.0);
}

TEST_F(GltfTest, DrawsTracksWithTheirGapsOpen) {
  const Glb glb = Export(test::ExampleContent());
  const Json& track = *glb.Find("ada track");
  const Json& lines = glb.json["meshes"][track["mesh"].get<size_t>()]["primitives"][0];
  const auto indices = glb.Values<uint32_t>(glb.json["accessors"][lines["indices"].get<size_t>()]);
  EXPECT_EQ(indices, (std::vector<uint32_t>{0, 1, 1, 2, 3, 4}));
  EXPECT_EQ((*glb.Find("ada last position"))["translation"], Json({7.0, 3.0, 1.0}));
}

TEST_F(GltfTest, JoinsMeshBlocksUntilAPrimitiveIsFull) {
  const auto mesh_of = [](const Glb& glb) {
    return glb.json["meshes"][(*glb.Find("mesh"))["mesh"].get<size_t>()]["primitives"];
  };
  EXPECT_EQ(mesh_of(Export(test::ExampleContent())).size(), 1u);
  const Glb cut = Export(test::ExampleContent(), 4);
  ASSERT_EQ(mesh_of(cut).size(), 2u);
  const Json second = mesh_of(cut)[1];
  const Json& positions = cut.json["accessors"][second["attributes"]["POSITION"].get<size_t>()];
  EXPECT_EQ(positions["min"], Json({2.0, 0.0, 0.0}));
  EXPECT_EQ(positions["max"], Json({4.0, 4.0, 0.0}));
}

TEST_F(GltfTest, OfAnEmptyMapIsAFileWithATopAndNoBinaryChunk) {
  const Glb glb = Export(MapContent());
  EXPECT_EQ(glb.json["nodes"].size(), 1u);
  EXPECT_TRUE(glb.binary.empty());
  EXPECT_FALSE(glb.json.contains("meshes"));
  EXPECT_FALSE(glb.json.contains("buffers"));
}

TEST_F(GltfTest, OfAMapWithoutMeshStillHoldsTheGraph) {
  MapContent content = test::ExampleContent();
  content.mesh.clear();
  const Glb glb = Export(content);
  EXPECT_EQ(glb.Find("mesh"), nullptr);
  EXPECT_NE(glb.Find("hall"), nullptr);
}

}  // namespace
}  // namespace dsg::cli
