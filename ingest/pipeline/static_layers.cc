// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/static_layers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "ingest/objects/object_matching.h"
#include "ingest/objects/paper_objects.h"
#include "ingest/objects/unlabelled_objects.h"
#include "ingest/pipeline/map_things.h"
#include "ingest/rooms/room_class.h"
#include "ingest/rooms/structure_rooms.h"

namespace dsg::ingest {
namespace {

// What is gone is told on, and never matched again.
GoneObject WithoutPoints(GoneObject gone) {
  gone.object.cluster.points_map = {};
  return gone;
}

}  // namespace

StaticLayers::StaticLayers(const MappingOptions& options, std::vector<SemanticLabel> labels,
                           const NodeNumbering& numbering)
    : options_(options),
      labels_(std::move(labels)),
      classes_(StructureClasses::FromLabels(labels_)),
      fitter_(options_.catalogue, options.shapes),
      maker_(numbering, NamesOf(labels_), options_.catalogue),
      volume_(options.volume),
      object_tracker_(/*forgets_lost=*/labels_.empty(), options.objects.match),
      object_classes_(ObjectClasses(labels_, classes_, options_.depth.dynamic_classes)),
      small_objects_(options.objects.small),
      carried_things_(options.objects.small),
      object_watch_(options.objects.watch),
      place_tracker_(options.places.same_m),
      structure_tracker_(options.structures),
      room_tracker_(options.rooms.same_place_m),
      is_asset_told_(options_.catalogue.size(), false) {}

absl::Status StaticLayers::Integrate(const DepthFrame& frame) {
  {
    const StageClock::Span span(&clock_, "fusion");
    const absl::Status status = volume_.Integrate(frame);
    if (!status.ok()) return status;
  }
  {
    const StageClock::Span span(&clock_, "small");
    std::vector<SmallSighting> sightings =
        FindSmallSightings(frame, object_classes_, options_.objects.small);
    carried_things_.See(sightings, frame.time_ns);
    small_objects_.See(frame, std::move(sightings));
    object_watch_.Watch(frame);
  }
  const Eigen::Vector3d& camera_map = frame.map_T_camera.position;
  if (viewpoints_.empty() ||
      (camera_map - viewpoints_.back().position_map).norm() > options_.layers.path_step_m) {
    viewpoints_.push_back({frame.time_ns, camera_map});
  }
  if (observed_together_ns_ == kTimeMin ||
      frame.time_ns - observed_together_ns_ >= options_.layers.together_period_ns) {
    observed_together_ns_ = frame.time_ns;
    together_.Observe(ObjectsInView(object_tracker_.objects(), frame, options_.layers.storeys));
  }
  return absl::OkStatus();
}

std::vector<Eigen::Vector3d> StaticLayers::SeenFrom() const {
  std::vector<Eigen::Vector3d> path_map;
  path_map.reserve(viewpoints_.size());
  for (const Viewpoint& viewpoint : viewpoints_) path_map.push_back(viewpoint.position_map);
  return path_map;
}

void StaticLayers::Correct(const TrajectoryChange& change) {
  const StageClock::Span span(&clock_, "correction");
  volume_.Move(change);
  // Places, rooms and structures are found anew; what they were goes along only to keep its name.
  const PointMove as_seen_near = [&](const Eigen::Vector3d& point_map) {
    const Viewpoint* nearest = nullptr;
    double nearest_m2 = std::numeric_limits<double>::infinity();
    for (const Viewpoint& viewpoint : viewpoints_) {
      const double distance_m2 = (viewpoint.position_map - point_map).squaredNorm();
      if (distance_m2 >= nearest_m2) continue;
      nearest_m2 = distance_m2;
      nearest = &viewpoint;
    }
    if (nearest == nullptr) return Pose3d();
    return MoveOf(point_map, nearest->time_ns, nearest->time_ns, change);
  };
  place_tracker_.Move(as_seen_near);
  structure_tracker_.Move(as_seen_near);
  room_tracker_.Move(as_seen_near);
  MoveObjects(change);
  for (Viewpoint& viewpoint : viewpoints_) {
    viewpoint.position_map = change.At(viewpoint.time_ns) * viewpoint.position_map;
  }
}

void StaticLayers::BeginAgain() {
  volume_.Clear();
  object_tracker_.BeginAgain();
}

absl::Status StaticLayers::IntegrateAgain(const DepthFrame& frame) {
  return volume_.Integrate(frame);
}

void StaticLayers::MoveObjects(const TrajectoryChange& change) {
  const auto move_fit = [&change](const TrackedObject& object, ShapeFit* fit) {
    fit->map_T_model = MoveOf(object, change) * fit->map_T_model;
  };
  for (const TrackedObject& object : object_tracker_.objects()) {
    const auto fit = fits_.find(object.id);
    if (fit != fits_.end()) move_fit(object, &fit->second);
  }
  for (GoneObject& gone : gone_) {
    if (gone.fit.has_value()) move_fit(gone.object, &*gone.fit);
    MoveCluster(MoveOf(gone.object, change), &gone.object.cluster);
  }
  object_tracker_.Move(change);
  small_objects_.Move(change);
  carried_things_.Move(change);
  object_watch_.Move(change);
}

std::vector<BlockIndex> StaticLayers::UpdateMesh(double block_size_m) {
  const StageClock::Span span(&clock_, "mesh");
  std::vector<BlockIndex> changed;
  for (MeshBlock& block : volume_.TakeChangedMesh(block_size_m)) {
    const BlockIndex index = block.index;
    changed.push_back(index);
    if (block.positions_map.empty()) {
      mesh_.erase(index);
    } else {
      mesh_[index] = std::move(block);
    }
  }
  return changed;
}

const MeshBlock* StaticLayers::FindBlock(const BlockIndex& index) const {
  const auto found = mesh_.find(index);
  return found == mesh_.end() ? nullptr : &found->second;
}

std::vector<const MeshBlock*> StaticLayers::Mesh() const {
  std::vector<const MeshBlock*> blocks;
  blocks.reserve(mesh_.size());
  for (const auto& [index, block] : mesh_) blocks.push_back(&block);
  return blocks;
}

bool StaticLayers::IsUpdateDue(TimeNs now_ns) const {
  if (mesh_.empty()) return false;
  if (updated_ns_ == kTimeMin) return true;
  return now_ns - updated_ns_ >= std::max(options_.layers_period_ns, update_cost_ns_);
}

LayerGraph StaticLayers::Update(TimeNs now_ns, bool is_last) {
  updated_ns_ = now_ns;
  LayerParts parts;
  const std::vector<const MeshBlock*> mesh = Mesh();
  {
    const StageClock::Span span(&clock_, "structures");
    parts.structures = FindStructures(mesh, classes_, options_.structures);
    structure_tracker_.Track(&parts.structures);
  }
  const std::vector<Eigen::Vector3d> path_map = SeenFrom();
  floors_m_ = FloorsOf(parts.structures, path_map, options_.structures, options_.layers.storeys);
  FindObjects(now_ns, mesh);
  FitShapes(floors_m_, is_last);
  // The last one is not needed beside the new one.
  field_.reset();
  field_ = std::make_shared<const DistanceField>(FindDistances(mesh, floors_m_));
  const DistanceField& field = *field_;
  {
    const StageClock::Span span(&clock_, "places");
    PlaceOptions place_options = options_.places;
    if (place_options.floors_m.empty()) place_options.floors_m = floors_m_;
    parts.places = ExtractPlaces(field.grid(), path_map, place_options);
    place_tracker_.Track(&parts.places);
  }
  parts.objects = object_tracker_.objects();
  parts.fits = fits_;
  parts.gone = gone_;
  parts.relations = FindRelations(parts.objects, options_.objects.relations);
  parts.together = KnownPairs(together_.Pairs(options_.layers.together_picture_count_min,
                                              options_.layers.together_partner_count_max),
                              parts.objects);
  FindPlacesOfObjects(field, &parts);
  {
    const StageClock::Span span(&clock_, "rooms");
    FindRoomsOf(field, &parts);
  }
  NoteCost(field.frame().CellCount());
  const StageClock::Span span(&clock_, "graph");
  return maker_.Make(parts);
}

DistanceField StaticLayers::FindDistances(const std::vector<const MeshBlock*>& mesh,
                                          const std::vector<double>& floors_m) {
  const StageClock::Span span(&clock_, "distances");
  OccupancyGrid grid =
      volume_.MakeOccupancy(std::max(options_.grid_cell_m, options_.volume.voxel_m));
  CloseGlass(mesh, GlassClasses(labels_), floors_m, options_.places.body_z_max_m,
             options_.layers.storeys, &grid);
  return DistanceField(std::move(grid));
}

std::function<bool(const Eigen::Vector3d&, const Eigen::Vector3d&)> StaticLayers::Sight() const {
  if (field_ == nullptr) return {};
  const bool is_on_floor = options_.places.mode == PlaceMode::kGround;
  return [field = field_, is_on_floor, places = options_.places](const Eigen::Vector3d& point_map,
                                                                 const Eigen::Vector3d& place_map) {
    return IsPlaceInSight(place_map, is_on_floor, *field, point_map, places);
  };
}

std::vector<Carry> StaticLayers::Carries() const {
  std::vector<Carry> carries = carried_things_.Carries();
  std::erase_if(
      carries, [this](const Carry& carry) { return !small_objects_.IsSmallClass(carry.class_id); });
  return carries;
}

void StaticLayers::NoteCost(int64_t cell_count) {
  size_t vertex_count = 0;
  for (const auto& [index, block] : mesh_) vertex_count += block.positions_map.size();
  const double cost_s = static_cast<double>(cell_count) / options_.layers.cells_per_second +
                        static_cast<double>(vertex_count) / options_.layers.vertices_per_second;
  update_cost_ns_ = static_cast<TimeNs>(cost_s * static_cast<double>(kNsPerSecond));
}

void StaticLayers::FindObjects(TimeNs now_ns, const std::vector<const MeshBlock*>& mesh) {
  const StageClock::Span span(&clock_, "objects");
  ClusterOptions options;
  options.voxel_m = options_.volume.voxel_m;
  options.class_ids = object_classes_;
  options.pieces = options_.objects.pieces;
  std::vector<ObjectCluster> clusters;
  if (options_.objects.is_paper) {
    clusters = FindPaperObjects(mesh, options);
  } else if (labels_.empty()) {
    clusters = FindUnlabelledObjects(mesh, kThingClass, options.voxel_m, floors_m_,
                                     options_.segments, options.pieces);
  } else {
    clusters = FindClusters(mesh, options);
  }
  if (!options_.objects.is_paper) {
    KeepVacated();
    small_objects_.Place(&clusters, options.pieces.box);
    object_watch_.DropResidues(&clusters);
  }
  const std::vector<TrackedObject> before = object_tracker_.objects();
  const ObjectChanges changes =
      object_tracker_.Update(std::move(clusters), now_ns, [this](const Eigen::Vector3f& point_map) {
        return volume_.At(point_map.cast<double>()) == Occupancy::kFree;
      });
  for (const auto& [part, whole] : changes.merged) together_.Merge(part, whole);
  for (const int64_t id : changes.gone) together_.Forget(id);
  for (const int64_t id : changes.forgotten) together_.Forget(id);
  KeepGone(before, changes, now_ns);
  if (!options_.objects.is_paper) object_watch_.Follow(object_tracker_.objects());
  unfitted_.insert(unfitted_.end(), changes.added.begin(), changes.added.end());
  unfitted_.insert(unfitted_.end(), changes.changed.begin(), changes.changed.end());
}

// Small things that pictures have shown to be gone, while their surface is still in the volume.
void StaticLayers::KeepVacated() {
  for (const VacatedObject& vacated : object_watch_.TakeVacated()) {
    const std::vector<TrackedObject>& objects = object_tracker_.objects();
    const auto object = std::find_if(objects.begin(), objects.end(), [&](const TrackedObject& one) {
      return one.id == vacated.id;
    });
    if (object == objects.end()) continue;
    small_objects_.Forget(object->cluster.class_id, AxisAlignedBox(object->cluster),
                          vacated.first_absent_ns);
    GoneObject gone{*object, std::nullopt, vacated.first_absent_ns};
    gone.object.last_observed_ns = std::max(vacated.last_present_ns, object->first_observed_ns);
    gone.gone_ns = std::max(gone.gone_ns, gone.object.last_observed_ns + 1);
    const auto fit = fits_.find(vacated.id);
    if (fit != fits_.end()) gone.fit = fit->second;
    gone_.push_back(WithoutPoints(std::move(gone)));
    together_.Forget(vacated.id);
    object_tracker_.Remove(vacated.id);
  }
}

// What left the world stays in the map, until when it was there.
void StaticLayers::KeepGone(const std::vector<TrackedObject>& before, const ObjectChanges& changes,
                            TimeNs now_ns) {
  for (const int64_t id : changes.gone) {
    const auto object =
        std::lower_bound(before.begin(), before.end(), id,
                         [](const TrackedObject& a, int64_t wanted) { return a.id < wanted; });
    if (object == before.end() || object->id != id) continue;
    GoneObject gone{*object, std::nullopt, now_ns};
    // Seen in this very update only: it was never there.
    if (object->first_observed_ns >= now_ns) continue;
    const auto fit = fits_.find(id);
    if (fit != fits_.end()) gone.fit = fit->second;
    gone_.push_back(WithoutPoints(std::move(gone)));
  }
}

void StaticLayers::FitShapes(const std::vector<double>& floors_m, bool is_last) {
  if (options_.catalogue.empty()) return;
  const StageClock::Span span(&clock_, "shapes");
  std::sort(unfitted_.begin(), unfitted_.end());
  unfitted_.erase(std::unique(unfitted_.begin(), unfitted_.end()), unfitted_.end());
  std::map<int64_t, const TrackedObject*> objects;
  for (const TrackedObject& object : object_tracker_.objects()) objects[object.id] = &object;
  std::erase_if(fits_, [&objects](const auto& entry) { return !objects.contains(entry.first); });
  int fit_count = 0;
  std::vector<int64_t> waiting;
  for (const int64_t id : unfitted_) {
    const auto object = objects.find(id);
    if (object == objects.end()) continue;
    if (!is_last && fit_count == options_.layers.fit_count) {
      waiting.push_back(id);
      continue;
    }
    const ObjectCluster& cluster = object->second->cluster;
    const std::string name = maker_.ClassName(cluster.class_id);
    if (!HasModelOf(options_.catalogue, name)) continue;
    ++fit_count;
    const std::optional<ShapeFit> fit = fitter_.Fit(
        name, cluster.points_map,
        [this](const Eigen::Vector3d& point_map) {
          return volume_.At(point_map) == Occupancy::kFree;
        },
        FloorUnder(cluster, floors_m, options_.layers.storeys));
    fits_.erase(id);
    if (!fit.has_value()) continue;
    fits_.emplace(id, *fit);
    TellAsset(fit->model);
  }
  unfitted_ = std::move(waiting);
}

void StaticLayers::TellAsset(int model) {
  if (is_asset_told_[model]) return;
  is_asset_told_[model] = true;
  assets_.push_back(options_.catalogue[model].asset);
}

std::vector<Asset> StaticLayers::TakeAssets() { return std::exchange(assets_, {}); }

void StaticLayers::FindPlacesOfObjects(const DistanceField& field, LayerParts* parts) const {
  for (const TrackedObject& object : parts->objects) {
    parts->place_of_object.push_back(
        NearestPlaceInSight(parts->places, field, object.cluster.center_map, options_.places));
  }
  for (const GoneObject& gone : parts->gone) {
    parts->place_of_object.push_back(
        NearestPlaceInSight(parts->places, field, gone.object.cluster.center_map, options_.places));
  }
}

std::vector<Storey> StaticLayers::FindStoreys(const LayerParts& parts) const {
  std::map<double, Storey> by_floor;
  for (size_t i = 0; i < parts.places.places.size(); ++i) {
    by_floor[parts.places.places[i].floor_z_m].places.push_back(static_cast<int>(i));
  }
  std::vector<Storey> storeys;
  for (auto& [floor_z_m, storey] : by_floor) {
    storey.floor_z_m = floor_z_m;
    const std::optional<double> ceiling =
        CeilingAbove(parts.structures, floor_z_m, options_.structures, options_.layers.storeys);
    storey.has_ceiling = ceiling.has_value();
    storey.ceiling_z_m = ceiling.value_or(floor_z_m + options_.layers.storeys.ceiling_guess_m);
    storeys.push_back(std::move(storey));
  }
  return storeys;
}

void StaticLayers::FindRoomsOf(const DistanceField& field, LayerParts* parts) {
  const std::vector<Place>& places = parts->places.places;
  parts->storeys = FindStoreys(*parts);
  parts->room_of_place.assign(places.size(), -1);
  std::vector<RoomPlace> all_places;
  for (const Place& place : places) all_places.push_back({place.position_map, place.clearance_m});
  std::vector<FoundRoom> rooms;
  for (size_t storey = 0; storey < parts->storeys.size(); ++storey) {
    RoomsOfStorey found =
        FindRoomsOfStorey(field, parts->places, parts->storeys[storey], options_.rooms);
    const int first = static_cast<int>(rooms.size());
    for (FoundRoom& room : found.rooms) {
      parts->rooms.push_back({{}, static_cast<int>(storey), found.method, {}});
      rooms.push_back(std::move(room));
    }
    for (const auto& [a, b] : found.adjacent) parts->adjacent.push_back({first + a, first + b});
    if (!found.other_room_of_place.empty()) {
      parts->other_room_of_place.resize(places.size(), -1);
      for (const auto& [place, room] : found.other_room_of_place) {
        parts->other_room_of_place[place] = room;
      }
    }
  }
  room_tracker_.Track(all_places, &rooms);
  for (size_t i = 0; i < rooms.size(); ++i) {
    for (const int place : rooms[i].places) parts->room_of_place[place] = static_cast<int>(i);
    parts->rooms[i].room = std::move(rooms[i]);
  }
  RelateStructures(parts);
  ClassifyRooms(parts);
}

void StaticLayers::RelateStructures(LayerParts* parts) const {
  std::vector<FoundRoom> rooms;
  for (const RoomPart& part : parts->rooms) rooms.push_back(part.room);
  parts->encloses = EnclosesOf(parts->structures, rooms, options_.structures);
  std::set<int64_t> supported;
  for (const ObjectRelation& relation : parts->relations) {
    if (relation.relation == relations::kOn || relation.relation == relations::kIn) {
      supported.insert(relation.first);
    }
  }
  for (size_t i = 0; i < parts->objects.size(); ++i) {
    const TrackedObject& object = parts->objects[i];
    const int place = parts->place_of_object[i];
    if (place < 0 || supported.contains(object.id)) continue;
    const ObjectCluster& cluster = object.cluster;
    const Box3d box =
        TransformBox(cluster.map_T_box, Box3d(-0.5 * cluster.size, 0.5 * cluster.size));
    const double floor_z_m = parts->places.places[static_cast<size_t>(place)].floor_z_m;
    if (box.min().z() <= floor_z_m + options_.structures.hang_above_m) continue;
    const std::optional<int> piece =
        AttachedTo(cluster.map_T_box, cluster.size, parts->structures, options_.structures);
    if (piece.has_value()) {
      parts->attached.push_back({static_cast<int>(i), *piece});
      continue;
    }
    const std::optional<int64_t> carrier =
        CarrierBeside(object, parts->objects, options_.objects.relations);
    if (carrier.has_value()) parts->relations.push_back({object.id, relations::kOn, *carrier, 1.0});
  }
}

void StaticLayers::ClassifyRooms(LayerParts* parts) const {
  std::vector<RoomContents> contents(parts->rooms.size());
  for (size_t i = 0; i < parts->objects.size(); ++i) {
    const int place = parts->place_of_object[i];
    const int room = place < 0 ? -1 : parts->room_of_place[place];
    if (room < 0) continue;
    contents[room].object_classes.push_back(maker_.ClassName(parts->objects[i].cluster.class_id));
  }
  for (const auto& [a, b] : parts->adjacent) {
    ++contents[a].door_count;
    ++contents[b].door_count;
  }
  for (size_t i = 0; i < contents.size(); ++i) {
    const FoundRoom& room = parts->rooms[i].room;
    contents[i].area_m2 = room.area_m2;
    contents[i].aspect = AspectOf(room.footprint_map);
    parts->rooms[i].class_probabilities = ClassifyRoom(contents[i]);
  }
}

}  // namespace dsg::ingest
