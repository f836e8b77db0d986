// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "ingest/simulator/scene/frame_internal.h"

namespace dsg::simulator {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

/// Of packets in the image, pixels: kPacketSize of them.
constexpr int kBlockColumns = 4;
constexpr int kBlockRows = 2;
/// Neighbours whose depths differ by more than this share lie on two sides of an edge.
constexpr float kEdgeRatio = 0.08f;
/// Rays beside the one through the centre, pixels; they sum up to nothing.
constexpr std::array<std::array<float, 2>, 3> kExtraRays = {
    {{0.36f, 0.08f}, {-0.25f, 0.29f}, {-0.11f, -0.37f}}};
/// Glass takes this share of the light from behind and adds as much of its own colour.
constexpr float kGlassShare = 0.2f;
/// A pixel counts as no longer than this many of its widths, however flat one looks.
constexpr float kCosineMin = 0.08f;

constexpr int32_t kNoSurface = -1;

float Gray(const Vector3f& rgb) { return 0.299f * rgb.x() + 0.587f * rgb.y() + 0.114f * rgb.z(); }

struct Sample {
  float depth_m = 0.0f;
  float cosine = 0.0f;
  int32_t surface = kNoSurface;
  int32_t face = -1;
  /// Index of the moving body; -1 = static.
  int32_t body = -1;
  uint16_t label = 0;
  Vector3f color = Vector3f::Zero();
};

/// One image in the making.
class Frame {
 public:
  Frame(const StaticScene& world, const BodyScene& bodies, const RayCamera& camera,
        const ViewWants& wants, RenderedView* view)
      : world_(world),
        bodies_(bodies),
        camera_(camera),
        wants_(wants),
        has_color_(wants.gray || wants.rgb),
        view_(*view),
        meter_per_pixel_(1.0f / static_cast<float>(camera.calibration.fx)) {
    const size_t count = static_cast<size_t>(view_.width) * static_cast<size_t>(view_.height);
    if (wants.gray) view_.gray.resize(count);
    if (wants.rgb) view_.rgb.resize(3 * count);
    if (wants.label) view_.label.resize(count);
    if (wants.face) view_.face.resize(count);
    view_.depth_m.resize(count);
    view_.incidence_cos.resize(count);
    surfaces_.resize(count);
  }

  void Run() {
    for (int row = 0; row < view_.height; row += kBlockRows) {
      for (int column = 0; column < view_.width; column += kBlockColumns) {
        CastBlock(column, row);
      }
    }
    if (has_color_) SmoothEdges();
    if (wants_.depth) return;
    view_.depth_m.clear();
    view_.incidence_cos.clear();
  }

 private:
  void CastBlock(int column, int row) {
    const PixelBox box = {column, row, std::min(column + kBlockColumns, view_.width) - 1,
                          std::min(row + kBlockRows, view_.height) - 1};
    std::array<Vector2f, kPacketSize> pixels;
    std::array<size_t, kPacketSize> indices;
    int count = 0;
    for (int y = box.row_min; y <= box.row_max; ++y) {
      for (int x = box.column_min; x <= box.column_max; ++x) {
        indices[count] = IndexOf(x, y);
        pixels[count++] = Vector2f(static_cast<float>(x), static_cast<float>(y));
      }
    }
    std::array<Sample, kPacketSize> samples;
    Cast(std::span(pixels).first(count), bodies_.MayCover(box), &samples);
    for (int i = 0; i < count; ++i) Store(indices[i], box, i, samples[i]);
  }

  void Store(size_t index, const PixelBox& box, int lane, const Sample& sample) {
    surfaces_[index] = sample.surface;
    view_.depth_m[index] = sample.depth_m;
    view_.incidence_cos[index] = sample.cosine;
    if (wants_.label) view_.label[index] = sample.label;
    if (wants_.face) view_.face[index] = sample.face;
    if (has_color_) StoreColor(index, sample.color);
    if (wants_.coverage && sample.body >= 0) {
      const int columns = box.column_max - box.column_min + 1;
      Count(box.column_min + lane % columns, box.row_min + lane / columns, sample.body);
    }
  }

  void StoreColor(size_t index, const Vector3f& color) {
    if (wants_.gray) view_.gray[index] = Gray(color);
    if (wants_.rgb)
      std::copy_n(color.data(), 3, view_.rgb.begin() + static_cast<ptrdiff_t>(3 * index));
  }

  void Count(int column, int row, int body) {
    BodyCoverage& coverage = view_.bodies[body];
    if (coverage.visible_pixel_count++ == 0) {
      coverage.column_min = coverage.column_max = column;
      coverage.row_min = coverage.row_max = row;
      return;
    }
    coverage.column_min = std::min(coverage.column_min, column);
    coverage.column_max = std::max(coverage.column_max, column);
    coverage.row_min = std::min(coverage.row_min, row);
    coverage.row_max = std::max(coverage.row_max, row);
  }

  // Rays through up to eight pixels.
  void Cast(std::span<const Vector2f> pixels, bool with_bodies,
            std::array<Sample, kPacketSize>* samples) const {
    Packet packet;
    packet.Reset(camera_.origin_map);
    std::array<Vector3f, kPacketSize> directions;
    for (size_t i = 0; i < pixels.size(); ++i) {
      directions[i] = camera_.Direction(pixels[i].x(), pixels[i].y());
      packet.Set(static_cast<int>(i), directions[i]);
    }
    packet.Trace(world_.opaque.get());
    std::array<bool, kPacketSize> hits_body{};
    if (with_bodies && bodies_.scene() != nullptr) {
      const Packet before = packet;
      packet.Trace(bodies_.scene());
      for (size_t i = 0; i < pixels.size(); ++i) {
        hits_body[i] = packet.rays.ray.tfar[i] < before.rays.ray.tfar[i];
      }
    }
    for (size_t i = 0; i < pixels.size(); ++i) {
      const int lane = static_cast<int>(i);
      if (!packet.Hit(lane)) continue;
      if (hits_body[i]) {
        ReadBody(packet, lane, directions[i], &(*samples)[i]);
      } else {
        ReadStatic(packet, lane, directions[i], &(*samples)[i]);
      }
    }
    if (has_color_ && world_.glass != nullptr) TintByGlass(packet, directions, samples);
  }

  float Footprint(float depth_m, float cosine) const {
    return depth_m * meter_per_pixel_ / std::max(cosine, kCosineMin);
  }

  void ReadStatic(const Packet& packet, int lane, const Vector3f& direction, Sample* sample) const {
    const FaceLook& look = world_.opaque_faces[packet.rays.hit.primID[lane]];
    sample->depth_m = packet.rays.ray.tfar[lane];
    sample->cosine = std::abs(look.normal.dot(direction)) / direction.norm();
    sample->surface = look.surface;
    sample->face = look.face;
    sample->label = world_.labels[look.part];
    if (has_color_) sample->color = StaticColor(look, packet, lane, direction, sample->cosine);
  }

  Vector3f StaticColor(const FaceLook& look, const Packet& packet, int lane,
                       const Vector3f& direction, float cosine) const {
    const float depth = packet.rays.ray.tfar[lane];
    const float u = packet.rays.hit.u[lane];
    const float v = packet.rays.hit.v[lane];
    const float light = look.light[0] + u * (look.light[1] - look.light[0]) +
                        v * (look.light[2] - look.light[0]) + world_.emissions[look.part];
    return light * Albedo(world_.surfaces[look.part], camera_.origin_map + depth * direction,
                          look.axis, Footprint(depth, cosine));
  }

  void ReadBody(const Packet& packet, int lane, const Vector3f& direction, Sample* sample) const {
    const RTCHit8& hit = packet.rays.hit;
    const uint32_t geometry = hit.geomID[lane];
    const Vector3f normal(hit.Ng_x[lane], hit.Ng_y[lane], hit.Ng_z[lane]);
    sample->depth_m = packet.rays.ray.tfar[lane];
    sample->cosine =
        std::abs(normal.dot(direction)) / std::max(normal.norm() * direction.norm(), 1e-12f);
    sample->body = bodies_.BodyOf(geometry);
    // Below kNoSurface, so that no static surface has the same.
    sample->surface = kNoSurface - 1 - sample->body;
    sample->label = bodies_.LabelOf(geometry);
    if (has_color_) {
      sample->color = bodies_.ColorAt(geometry, {hit.primID[lane], hit.u[lane], hit.v[lane]},
                                      Footprint(sample->depth_m, sample->cosine));
    }
  }

  // The nearest pane alone counts: both faces of one stand close together.
  void TintByGlass(const Packet& packet, const std::array<Vector3f, kPacketSize>& directions,
                   std::array<Sample, kPacketSize>* samples) const {
    Packet glass = packet;
    std::fill(std::begin(glass.rays.hit.geomID), std::end(glass.rays.hit.geomID),
              RTC_INVALID_GEOMETRY_ID);
    glass.Trace(world_.glass.get());
    for (int lane = 0; lane < kPacketSize; ++lane) {
      if (packet.valid[lane] == 0 || !glass.Hit(lane)) continue;
      const FaceLook& look = world_.glass_faces[glass.rays.hit.primID[lane]];
      const Vector3f& direction = directions[lane];
      const float cosine = std::abs(look.normal.dot(direction)) / direction.norm();
      const Vector3f tint = StaticColor(look, glass, lane, direction, cosine);
      Vector3f& color = (*samples)[lane].color;
      color = (1.0f - kGlassShare) * color + kGlassShare * tint;
    }
  }

  bool IsEdge(size_t a, size_t b) const {
    if (surfaces_[a] != surfaces_[b]) return true;
    const float nearer = std::min(view_.depth_m[a], view_.depth_m[b]);
    return std::abs(view_.depth_m[a] - view_.depth_m[b]) > kEdgeRatio * nearer;
  }

  // More rays for pixels at edges, so that outlines do not jump from pixel to pixel.
  void SmoothEdges() {
    const int width = view_.width;
    std::vector<uint8_t> edges(surfaces_.size());
    for (int row = 0; row < view_.height; ++row) {
      for (int column = 0; column < width; ++column) {
        const size_t index = IndexOf(column, row);
        if (column + 1 < width && IsEdge(index, index + 1)) edges[index] = edges[index + 1] = 1;
        if (row + 1 < view_.height && IsEdge(index, index + static_cast<size_t>(width))) {
          edges[index] = edges[index + static_cast<size_t>(width)] = 1;
        }
      }
    }
    std::vector<size_t> pixels;
    for (size_t i = 0; i < edges.size(); ++i) {
      if (edges[i] != 0) pixels.push_back(i);
    }
    for (size_t i = 0; i < pixels.size(); i += kPacketSize) {
      Smooth(std::span(pixels).subspan(i, std::min<size_t>(kPacketSize, pixels.size() - i)));
    }
  }

  // One packet for each of the extra rays of up to eight pixels.
  void Smooth(std::span<const size_t> pixels) {
    constexpr float kShare = 1.0f / (1.0f + static_cast<float>(kExtraRays.size()));
    std::array<Vector3f, kPacketSize> sums;
    sums.fill(Vector3f::Zero());
    for (const std::array<float, 2>& extra : kExtraRays) {
      std::array<Vector2f, kPacketSize> points;
      for (size_t i = 0; i < pixels.size(); ++i) {
        const size_t row = pixels[i] / static_cast<size_t>(view_.width);
        const size_t column = pixels[i] % static_cast<size_t>(view_.width);
        points[i] =
            Vector2f(static_cast<float>(column) + extra[0], static_cast<float>(row) + extra[1]);
      }
      std::array<Sample, kPacketSize> samples;
      Cast(std::span(points).first(pixels.size()), true, &samples);
      for (size_t i = 0; i < pixels.size(); ++i) sums[i] += kShare * samples[i].color;
    }
    for (size_t i = 0; i < pixels.size(); ++i) AddColor(pixels[i], kShare, sums[i]);
  }

  void AddColor(size_t index, float share, const Vector3f& sum) {
    if (wants_.gray) view_.gray[index] = share * view_.gray[index] + Gray(sum);
    if (!wants_.rgb) return;
    for (size_t i = 0; i < 3; ++i) {
      float& value = view_.rgb[3 * index + i];
      value = share * value + sum[static_cast<int>(i)];
    }
  }

  size_t IndexOf(int column, int row) const {
    return static_cast<size_t>(row) * static_cast<size_t>(view_.width) +
           static_cast<size_t>(column);
  }

  const StaticScene& world_;
  const BodyScene& bodies_;
  const RayCamera& camera_;
  const ViewWants& wants_;
  const bool has_color_;
  RenderedView& view_;
  const float meter_per_pixel_;
  std::vector<int32_t> surfaces_;
};

}  // namespace

void DrawFrame(const StaticScene& world, const BodyScene& bodies, const RayCamera& camera,
               const ViewWants& wants, RenderedView* view) {
  Frame(world, bodies, camera, wants, view).Run();
}

}  // namespace dsg::simulator
