// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/scene/texture.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace dsg::simulator {
namespace {

using Eigen::Vector3f;

constexpr int kOctaveCount = 6;
/// Wavelengths of the octaves: 6 mm, and each 2.6 times the one before.
constexpr std::array<float, kOctaveCount> kWaveM = {0.006f,  0.0156f,  0.04056f,
                                                    0.1055f, 0.27419f, 0.71288f};
constexpr std::array<float, kOctaveCount> kPerWave = {1.0f / kWaveM[0], 1.0f / kWaveM[1],
                                                      1.0f / kWaveM[2], 1.0f / kWaveM[3],
                                                      1.0f / kWaveM[4], 1.0f / kWaveM[5]};
/// How strongly each octave shows.
using Gains = std::array<float, kOctaveCount>;

constexpr int kLatticeBits = 7;
constexpr uint32_t kLatticeMask = (1u << kLatticeBits) - 1u;

constexpr std::array<float, 1u << (2 * kLatticeBits)> MakeLattice() {
  std::array<float, 1u << (2 * kLatticeBits)> lattice{};
  for (uint32_t i = 0; i < lattice.size(); ++i) {
    lattice[i] = static_cast<float>(static_cast<int>(Hash(i, 77u) & 0xffffu) - 0x8000) / 32768.0f;
  }
  return lattice;
}

// 64 KB stay in the cache; hashing each corner anew costs three times as much.
constexpr auto kLattice = MakeLattice();

inline int Floor(float x) {
  // std::floor is a call without SSE 4.1.
  const int cut = static_cast<int>(x);
  return cut - static_cast<int>(static_cast<float>(cut) > x);
}

// Mean of the four lattice values around a cell, by weights.
inline float Mix(int x, int y, uint32_t seed, float weight_x, float weight_y) {
  const uint32_t column = static_cast<uint32_t>(x) + (seed >> 24);
  const uint32_t row = static_cast<uint32_t>(y) + (seed >> 16);
  const float* low = kLattice.data() + ((row & kLatticeMask) << kLatticeBits);
  const float* high = kLattice.data() + (((row + 1u) & kLatticeMask) << kLatticeBits);
  const uint32_t left = column & kLatticeMask;
  const uint32_t right = (column + 1u) & kLatticeMask;
  const float below = low[left] + (low[right] - low[left]) * weight_x;
  const float above = high[left] + (high[right] - high[left]) * weight_x;
  return below + (above - below) * weight_y;
}

inline float Smooth(float t) { return t * t * (3.0f - 2.0f * t); }
inline float Clamp01(float value) { return std::min(std::max(value, 0.0f), 1.0f); }

// Smooth noise of wavelength 1, -1 to 1.
inline float Noise(float x, float y, uint32_t seed) {
  const int column = Floor(x);
  const int row = Floor(y);
  return Mix(column, row, seed, Smooth(x - static_cast<float>(column)),
             Smooth(y - static_cast<float>(row)));
}

// One random value for each cell of size 1, -1 to 1; borders are as wide as a pixel.
// `cell_per_pixel` is the footprint in cells. Fades to the mean where cells get too small.
inline float Cells(float x, float y, float cell_per_pixel, uint32_t seed) {
  const float fade = Clamp01(2.0f - 3.0f * cell_per_pixel);
  if (fade <= 0.0f) return 0.0f;
  const int column = Floor(x - 0.5f);
  const int row = Floor(y - 0.5f);
  const float sharp = 1.0f / std::max(cell_per_pixel, 1e-3f);
  return fade * Mix(column, row, seed,
                    Clamp01((x - 1.0f - static_cast<float>(column)) * sharp + 0.5f),
                    Clamp01((y - 1.0f - static_cast<float>(row)) * sharp + 0.5f));
}

// Share of a pixel that lines of `width` at whole numbers cover; all in periods.
inline float Line(float x, float width, float pixel) {
  const float distance = std::abs(x - static_cast<float>(Floor(x + 0.5f)));
  // Half as wide again as a pixel: a line one pixel wide would jump with it.
  const float span = std::max(1.5f * pixel, 1e-4f);
  const float cover = std::min(Clamp01((0.5f * (width + span) - distance) / span), width / span);
  const float fade = Clamp01(2.0f - 2.5f * span);
  return width + fade * (std::min(cover, 1.0f) - width);
}

// 1 inside of [-half, half], 0 outside, the edge as wide as a pixel.
inline float Inside(float x, float half, float pixel) {
  return Clamp01((half - std::abs(x)) / pixel + 0.5f);
}

// Noise of all octaves that a pixel can still tell.
float Octaves(float u, float v, uint32_t seed, float footprint, const Gains& gains) {
  const float per_footprint = 1.0f / (1.5f * footprint);
  int first = 0;
  while (first < kOctaveCount && kWaveM[first] <= 2.0f * footprint) ++first;
  float sum = 0.0f;
  for (int i = first; i < kOctaveCount; ++i) {
    const float fade = std::min((kWaveM[i] - 2.0f * footprint) * per_footprint, 1.0f);
    const uint32_t own = seed * 0x9e3779b1u + static_cast<uint32_t>(i) * 0x3c6ef372u;
    sum += fade * gains[i] * Noise(u * kPerWave[i], v * kPerWave[i], own);
  }
  return sum;
}

Vector3f ColorFrom(uint32_t hash) {
  const auto part = [hash](int shift) {
    return 0.15f + 0.75f * static_cast<float>((hash >> shift) & 255u) / 255.0f;
  };
  return {part(0), part(8), part(16)};
}

// Blocks of colour and lines of text, as on posters and screens.
Vector3f Print(float u, float v, float pixel, const Vector3f& paper, uint32_t seed) {
  const uint32_t hash = Hash(seed, 5u);
  const float size = 0.05f + 0.04f * static_cast<float>(hash & 3u);
  const float block = Cells(u / size, v / (0.75f * size), pixel / (0.75f * size), hash);
  const float tone = Cells(u / size, v / (0.75f * size), pixel / (0.75f * size), Hash(hash, 1u));
  Vector3f color = paper * (0.92f + 0.08f * tone);
  const float mark = Clamp01((block - 0.45f * paper.y()) * 6.0f);
  const Vector3f ink = ColorFrom(Hash(hash, tone > 0.0f ? 2u : 3u));
  color += mark * (ink * (0.8f + 0.3f * tone) - color);
  constexpr float kRowM = 0.02f;
  const float rows = Line(v / kRowM, 0.45f, pixel / kRowM);
  const float words =
      Clamp01(0.5f + 2.0f * Cells(u / 0.028f, v / kRowM + 0.5f, pixel / kRowM, hash));
  const float text = (1.0f - mark) * Clamp01(1.5f - pixel / kRowM) * rows * words;
  return color * (1.0f - 0.75f * text);
}

Vector3f Books(float u, float v, float pixel, const Surface& surface) {
  constexpr float kSpineM = 0.034f;
  const float x = u / kSpineM;
  const float thin = pixel / kSpineM;
  const float tone = Cells(x, 0.5f, thin, surface.seed);
  const float warm = Cells(x, 0.5f, thin, Hash(surface.seed, 1u));
  Vector3f color = surface.color * (1.0f + 0.55f * tone);
  color.x() *= 1.0f + 0.4f * warm;
  color.z() *= 1.0f - 0.4f * warm;
  const float gap = Line(x, 0.1f, thin);
  const float title = Clamp01(
      4.0f * Cells(x, v / 0.045f, std::max(thin, pixel / 0.045f), Hash(surface.seed, 2u)) - 1.6f);
  color += 0.6f * title * (Vector3f(0.9f, 0.85f, 0.7f) - color);
  return color * (1.0f - 0.6f * gap);
}

// Posters hang on a wall at eye level, one every two metres or so.
void HangPoster(float u, float v, float pixel, uint32_t seed, Vector3f* color) {
  constexpr float kPitchM = 1.9f;
  const int place = Floor(u / kPitchM);
  const uint32_t hash = Hash(seed, static_cast<uint32_t>(place));
  if ((hash & 7u) > 4u) return;
  const auto part = [hash](int shift) { return static_cast<float>((hash >> shift) & 63u) / 63.0f; };
  const float half_u = 0.16f + 0.28f * part(3);
  const float half_v = 0.2f + 0.2f * part(9);
  const float middle =
      (static_cast<float>(place) + 0.5f) * kPitchM + (part(15) - 0.5f) * (kPitchM - 2.0f * half_u);
  const float x = u - middle;
  const float y = v - 1.4f - 0.25f * part(21);
  const float inside = Inside(x, half_u, pixel) * Inside(y, half_v, pixel);
  if (inside <= 0.0f) return;
  constexpr float kBorderM = 0.025f;
  const float print = Inside(x, half_u - kBorderM, pixel) * Inside(y, half_v - kBorderM, pixel);
  const Vector3f frame = Vector3f::Constant(0.12f + 0.6f * part(4));
  const Vector3f paper = 0.75f * Vector3f::Ones() + 0.2f * ColorFrom(hash);
  Vector3f poster = frame;
  if (print > 0.0f) poster += print * (Print(x + 9.0f, y + 9.0f, pixel, paper, hash) - frame);
  *color += inside * (poster - *color);
}

Vector3f Plaster(float u, float v, bool is_upright, float pixel, const Surface& surface) {
  constexpr Gains kGains = {0.09f, 0.1f, 0.09f, 0.06f, 0.04f, 0.03f};
  float shade = Octaves(u, v, surface.seed, pixel, kGains);
  if (!is_upright) return surface.color * (1.0f + shade);
  // Scuffs: where shoes, chairs and carts touch.
  if (v < 1.2f && pixel < 0.03f) {
    const float scuff = Noise(u * 4.0f, v * 17.0f, Hash(surface.seed, 3u)) - 0.45f;
    shade -= Clamp01(5.0f * scuff) * 0.3f * (1.2f - v) * Clamp01(2.0f - pixel / 0.015f);
  }
  Vector3f color = surface.color * (1.0f + shade);
  HangPoster(u, v, pixel, surface.seed, &color);
  return color;
}

Vector3f Tiles(float u, float v, float pixel, const Surface& surface) {
  constexpr Gains kGains = {0.1f, 0.12f, 0.11f, 0.08f, 0.04f, 0.04f};
  constexpr std::array<float, 4> kSizesM = {0.15f, 0.3f, 0.45f, 0.6f};
  const float size = kSizesM[surface.seed & 3u];
  const float thin = pixel / size;
  const float joint =
      std::max(Line(u / size, 0.008f / size, thin), Line(v / size, 0.008f / size, thin));
  const float shade = Octaves(u, v, surface.seed, pixel, kGains) +
                      0.13f * Cells(u / size, v / size, thin, surface.seed);
  return surface.color * ((1.0f + shade) * (1.0f - 0.5f * joint));
}

Vector3f Wood(float u, float v, float pixel, const Surface& surface) {
  constexpr Gains kGains = {0.1f, 0.14f, 0.16f, 0.1f, 0.07f, 0.05f};
  constexpr float kWidthM = 0.14f;
  constexpr float kLengthM = 1.3f;
  const int row = Floor(v / kWidthM);
  const float shift =
      static_cast<float>(Hash(surface.seed, static_cast<uint32_t>(row)) & 255u) / 255.0f;
  const float thin = pixel / kWidthM;
  const float plank = Cells(u / kLengthM + shift, v / kWidthM, thin, surface.seed);
  const float end = Line(u / kLengthM + shift, 0.003f / kLengthM, pixel / kLengthM);
  const float joint = std::max(end, Line(v / kWidthM, 0.025f, thin));
  const float grain = Octaves(0.22f * u + 3.0f * shift, v, surface.seed, pixel, kGains);
  return surface.color * ((1.0f + grain + 0.14f * plank) * (1.0f - 0.5f * joint));
}

Vector3f Fabric(float u, float v, float pixel, const Surface& surface) {
  constexpr Gains kGains = {0.2f, 0.17f, 0.11f, 0.08f, 0.05f, 0.03f};
  float shade = Octaves(u, v, surface.seed, pixel, kGains);
  constexpr float kCheckM = 0.09f;
  const float thin = pixel / kCheckM;
  shade += (surface.seed & 1u) != 0
               ? 0.14f * (Line(u / kCheckM, 0.3f, thin) + Line(v / kCheckM, 0.3f, thin)) - 0.08f
               : 0.12f * Cells(u / kCheckM, v / kCheckM, thin, Hash(surface.seed, 4u));
  return surface.color * (1.0f + shade);
}

Vector3f Carpet(float u, float v, float pixel, const Surface& surface) {
  constexpr Gains kGains = {0.24f, 0.2f, 0.14f, 0.1f, 0.08f, 0.05f};
  constexpr float kTileM = 0.5f;
  const float tile = Cells(u / kTileM, v / kTileM, pixel / kTileM, surface.seed);
  const float fleck = Noise(u / 0.08f, v / 0.08f, Hash(surface.seed, 6u)) - 0.5f;
  const float flecks = 0.35f * Clamp01(4.0f * fleck) * Clamp01(2.0f - pixel / 0.02f);
  return surface.color *
         (1.0f + Octaves(u, v, surface.seed, pixel, kGains) + 0.08f * tile + flecks);
}

Vector3f Plain(float u, float v, float pixel, const Surface& surface, const Gains& gains) {
  return surface.color * (1.0f + Octaves(u, v, surface.seed, pixel, gains));
}

Vector3f AlbedoAt(const Surface& surface, float u, float v, bool is_upright, float pixel) {
  constexpr Gains kMetal = {0.06f, 0.08f, 0.08f, 0.07f, 0.05f, 0.04f};
  constexpr Gains kPlastic = {0.08f, 0.09f, 0.08f, 0.06f, 0.04f, 0.03f};
  constexpr Gains kLeaves = {0.2f, 0.2f, 0.14f, 0.1f, 0.05f, 0.0f};
  constexpr Gains kSkin = {0.05f, 0.06f, 0.06f, 0.04f, 0.02f, 0.0f};
  constexpr Gains kGlass = {0.0f, 0.0f, 0.06f, 0.08f, 0.08f, 0.08f};
  switch (surface.material) {
    case Material::kPlaster:
      return Plaster(u, v, is_upright, pixel, surface);
    case Material::kTiles:
      return Tiles(u, v, pixel, surface);
    case Material::kCarpet:
      return Carpet(u, v, pixel, surface);
    case Material::kWood:
      return Wood(u, v, pixel, surface);
    case Material::kFabric:
      return Fabric(u, v, pixel, surface);
    case Material::kMetal:
      return Plain(0.3f * u, v, pixel, surface, kMetal);
    case Material::kPlastic:
      return Plain(u, v, pixel, surface, kPlastic);
    case Material::kPaper:
      return Print(u, v, pixel, surface.color, surface.seed);
    case Material::kBooks:
      return is_upright ? Books(u, v, pixel, surface) : Plain(u, v, pixel, surface, kPlastic);
    case Material::kLeaves:
      return Plain(u, v, pixel, surface, kLeaves);
    case Material::kSkin:
      return Plain(u, v, pixel, surface, kSkin);
    case Material::kGlass:
      return Plain(u, v, pixel, surface, kGlass);
    case Material::kBlank:
      break;
  }
  return surface.color;
}

}  // namespace

Surface MakeSurface(Material material, const Color& color, uint32_t seed) {
  return {material, Vector3f(color[0], color[1], color[2]) / 255.0f, seed};
}

int ProjectionAxis(const Vector3f& normal) {
  const Vector3f size = normal.cwiseAbs();
  if (size.z() >= size.x() && size.z() >= size.y()) return 2;
  return size.x() >= size.y() ? 0 : 1;
}

Vector3f Albedo(const Surface& surface, const Vector3f& point, int axis, float footprint_m) {
  const float u = axis == 0 ? point.y() : point.x();
  const float v = axis == 2 ? point.y() : point.z();
  return AlbedoAt(surface, u, v, axis != 2, footprint_m).cwiseMax(0.0f).cwiseMin(1.0f);
}

}  // namespace dsg::simulator
