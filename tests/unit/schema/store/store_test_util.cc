// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/schema/store/store_test_util.h"

#include <filesystem>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace dsg::test {

int64_t EnvNumber(const char* name, int64_t fallback) {
  const char* text = std::getenv(name);
  return text == nullptr || *text == '\0' ? fallback : std::atoll(text);
}

uint64_t RecordSeed() {
  const int64_t seed = EnvNumber("DSG_SEED", 20'240'607);
  std::printf("seed: DSG_SEED=%lld\n", static_cast<long long>(seed));
  return static_cast<uint64_t>(seed);
}

MapSpec Spec(TrajectoryCodec codec) {
  MapSpec spec;
  spec.name = kMap;
  spec.codec = codec;
  return spec;
}

std::vector<std::string> Backends() { return {"sqlite", "memory"}; }

std::string UriOf(const std::string& backend, const std::string& folder) {
  return (backend == "sqlite" ? "file" : backend) + ":" + folder;
}

std::string NameOfBackendAndCodec(
    const testing::TestParamInfo<std::tuple<std::string, TrajectoryCodec>>& info) {
  const auto& [backend, codec] = info.param;
  return backend + (codec == TrajectoryCodec::kLossless ? "Lossless" : "Quantized");
}

TestMap::TestMap(const std::string& backend, const MapSpec& spec) {
  StoreOptions options;
  options.create = true;
  options.program = "store-test";
  store_ = OrDie(OpenStore(UriOf(backend, folder_.path()), options));
  OrDie(store_->CreateMap(spec));
  Reopen();
}

void TestMap::Close() {
  writer_.reset();
  reader_.reset();
}

void TestMap::Reopen() {
  writer_ = OrDie(store_->OpenWriter(kMap));
  reader_ = OrDie(store_->OpenMap(kMap));
}

absl::StatusOr<CommitResult> TestMap::Commit(GraphDelta delta) {
  delta.map = kMap;
  delta.session_id = "test";
  DSG_ASSIGN_OR_RETURN(const SessionState session, writer_->GetSession(delta.session_id));
  delta.sequence = session.last_sequence + 1;
  return writer_->Commit(std::move(delta));
}

Revision TestMap::MustCommit(GraphDelta delta) { return OrDie(Commit(std::move(delta))).revision; }

std::string TestMap::Problems() {
  std::string text;
  for (const std::string& problem : OrDie(reader_->Verify({}, {})).problems) text += problem + "\n";
  return text;
}

absl::StatusOr<std::vector<StreamRow>> ReadAllRows(MapReader* map) {
  std::vector<StreamRow> rows;
  DSG_RETURN_IF_ERROR(map->ReadRows(
      [&](const StreamRow& row) {
        rows.push_back(row);
        return absl::OkStatus();
      },
      {}));
  return rows;
}

RowSource SourceOf(const std::vector<StreamRow>& rows) {
  return [&rows, next = size_t{0}](StreamRow* row) mutable -> absl::StatusOr<bool> {
    if (next == rows.size()) return false;
    *row = rows[next++];
    return true;
  };
}

std::string TextOf(const StreamRow& row) {
  std::string text = absl::StrCat(std::string(1, row.kind), " ", absl::StrJoin(row.numbers, " "));
  for (const std::string& part : row.texts) {
    absl::StrAppend(&text, " ", absl::BytesToHexString(part));
  }
  return text;
}

std::string TimelessText(std::vector<StreamRow> rows) {
  std::string text;
  for (StreamRow& row : rows) {
    if (row.kind == row_kinds::kRevision || row.kind == row_kinds::kTag) row.numbers[1] = 0;
    absl::StrAppend(&text, TextOf(row), "\n");
  }
  return text;
}

MapOfRows::MapOfRows(const std::string& backend, const MapSpec& spec,
                     const std::vector<StreamRow>& rows) {
  store_ = OrDie(OpenStore(UriOf(backend, folder_.path()), {.create = true}));
  const std::string scratch = folder_.path() + "/.scratch";
  std::filesystem::create_directories(scratch);
  OrDie(store_->InstallRows(spec, SourceOf(rows), scratch, /*replace=*/false, {}));
  writer_ = OrDie(store_->OpenWriter(spec.name));
  reader_ = OrDie(store_->OpenMap(spec.name));
}

void ExpectEqualMaps(MapReader* map, MapReader* copy, bool answers) {
  EXPECT_EQ(OrDie(copy->Verify({}, {})).problems, std::vector<std::string>());
  const auto rows = OrDie(ReadAllRows(map));
  const auto again = OrDie(ReadAllRows(copy));
  for (size_t i = 0; i < std::min(rows.size(), again.size()); ++i) {
    ASSERT_EQ(TextOf(rows[i]), TextOf(again[i]));
  }
  ASSERT_EQ(rows.size(), again.size());
  EXPECT_EQ(OrDie(map->OldestRevision()), OrDie(copy->OldestRevision()));
  const Revision newest = OrDie(map->Head()).revision;
  for (Revision revision = 0; revision <= newest; ++revision) {
    const auto at = map->At(revision);
    const auto other = copy->At(revision);
    ASSERT_EQ(at.status(), other.status()) << revision;
    if (!at.ok()) continue;
    EXPECT_EQ(OrDie((*at)->Stats()).at.digest, OrDie((*other)->Stats()).at.digest) << revision;
    if (!answers || revision % 6 != newest % 6) continue;
    const bool is_equal = OrDie(Dump(**at)) == OrDie(Dump(**other));
    ASSERT_TRUE(is_equal) << "other answers at revision " << revision;
  }
}

Box3d BoxOf(double x0, double y0, double z0, double x1, double y1, double z1) {
  return Box3d(Eigen::Vector3d(x0, y0, z0), Eigen::Vector3d(x1, y1, z1));
}

TimedPose PoseAt(TimeNs time_ns, double x, double y, double z) {
  TimedPose pose;
  pose.time_ns = time_ns;
  pose.map_T_agent.position = Eigen::Vector3d(x, y, z);
  return pose;
}

Node MakeNode(NodeId id, LayerId layer, const std::string& kind, const std::string& name,
              const Box3d& box_map) {
  Node node;
  node.id = id;
  node.layer = layer;
  node.kind = kind;
  node.name = name;
  if (!box_map.isEmpty()) {
    node.map_T_node.position = box_map.center();
    node.box_node = Box3d(box_map.min() - box_map.center(), box_map.max() - box_map.center());
  }
  return node;
}

Node MakeObject(uint64_t index, const std::string& name, const Box3d& box_map) {
  return MakeNode(NodeId('O', index), layers::kObjects, kinds::kObject, name, box_map);
}

Node MakeHuman(uint64_t index, const std::string& name) {
  return MakeNode(NodeId('H', index), layers::kAgents, kinds::kHuman, name, Box3d());
}

Edge MakeEdge(NodeId source, const std::string& relation, NodeId target) {
  Edge edge;
  edge.source = source;
  edge.relation = relation;
  edge.target = target;
  return edge;
}

GraphDelta DeltaOfNodes(std::vector<Node> nodes) {
  GraphDelta delta;
  delta.nodes = std::move(nodes);
  return delta;
}

GraphDelta DeltaOfPoses(NodeId agent, std::vector<TimedPose> poses) {
  GraphDelta delta;
  delta.appends.push_back({agent, std::move(poses)});
  return delta;
}

}  // namespace dsg::test
