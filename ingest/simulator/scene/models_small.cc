// SPDX-License-Identifier: Apache-2.0
// What one can carry, what hangs on walls, and plants.
#include <algorithm>
#include <cmath>

#include "ingest/simulator/scene/models.h"

namespace dsg::simulator {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

void DrawCup(Model* m) {
  const float radius = 0.5f * m->depth;
  m->Use(Material::kPlastic, m->color);
  AddTurned({{0.0f, 0.0f},
             {0.8f * radius, 0.0f},
             {radius, 0.2f * m->height},
             {radius, m->height},
             {0.86f * radius, m->height},
             {0.8f * radius, 0.08f * m->height},
             {0.0f, 0.08f * m->height}},
            Vector3f::Zero(), Vector2f(0.85f, 1.0f), 16, m->mesh());
  const float x = 0.5f * m->width;
  m->Box({0.78f * x, -0.12f * radius, 0.7f * m->height}, {x, 0.12f * radius, 0.8f * m->height});
  m->Box({0.9f * x, -0.12f * radius, 0.3f * m->height}, {x, 0.12f * radius, 0.8f * m->height});
  m->Box({0.78f * x, -0.12f * radius, 0.25f * m->height}, {x, 0.12f * radius, 0.35f * m->height});
  m->Use(Material::kPaper, Scaled(m->color, 0.8));
  AddTurned({{1.01f * radius, 0.4f * m->height}, {1.01f * radius, 0.7f * m->height}},
            Vector3f::Zero(), Vector2f(0.85f, 1.0f), 16, m->mesh());
}

void DrawBowl(Model* m) {
  const float h = m->height;
  m->Use(Material::kPlastic, m->color);
  AddTurned({{0.0f, 0.0f},
             {0.45f, 0.0f},
             {0.8f, 0.4f * h},
             {1.0f, h},
             {0.93f, h},
             {0.72f, 0.45f * h},
             {0.4f, 0.12f * h},
             {0.0f, 0.1f * h}},
            Vector3f::Zero(), Vector2f(0.5f * m->width, 0.5f * m->depth), 20, m->mesh());
}

void DrawBottle(Model* m) {
  const float h = m->height;
  const Vector2f stretch(0.5f * m->width, 0.5f * m->depth);
  m->Use(Material::kPlastic, m->color);
  AddTurned({{0.0f, 0.0f},
             {0.95f, 0.0f},
             {1.0f, 0.05f * h},
             {1.0f, 0.6f * h},
             {0.4f, 0.8f * h},
             {0.35f, 0.92f * h},
             {0.0f, 0.92f * h}},
            Vector3f::Zero(), stretch, 14, m->mesh());
  m->Use(Material::kPaper, {214, 196, 120, 255});
  AddTurned({{1.0f, 0.2f * h}, {1.01f, 0.22f * h}, {1.01f, 0.5f * h}, {1.0f, 0.52f * h}},
            Vector3f::Zero(), stretch, 14, m->mesh());
  m->Use(Material::kPlastic, {186, 48, 44, 255});
  AddTurned({{0.42f, 0.9f * h}, {0.42f, h}, {0.0f, h}}, Vector3f::Zero(), stretch, 10, m->mesh());
}

void DrawVase(Model* m) {
  const float h = m->height;
  m->Use(Material::kTiles, m->color);
  AddTurned({{0.0f, 0.0f},
             {0.5f, 0.0f},
             {1.0f, 0.4f * h},
             {0.5f, 0.85f * h},
             {0.65f, h},
             {0.55f, h},
             {0.4f, 0.85f * h},
             {0.0f, 0.5f * h}},
            Vector3f::Zero(), Vector2f(0.5f * m->width, 0.5f * m->depth), 16, m->mesh());
}

void DrawPhone(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  m->Use(Material::kPlastic, m->color);
  m->Box({-x, -y, 0.0f}, {x, y, 0.9f * m->height}, 0.003f);
  m->Use(Material::kPaper, {96, 132, 170, 255});
  m->Box({-0.9f * x, -0.9f * y, 0.5f * m->height}, {0.9f * x, 0.9f * y, m->height});
}

void DrawBook(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  const float cover = 0.12f * m->height;
  m->Use(Material::kPaper, m->color);
  m->Box({-x, -y, 0.0f}, {x, y, cover});
  m->Box({-x, -y, m->height - cover}, {x, y, m->height});
  m->Box({-x, -y, 0.0f}, {-0.94f * x, y, m->height});
  m->Use(Material::kPlastic, {226, 220, 204, 255});
  m->Box({-0.94f * x, -0.95f * y, cover}, {0.96f * x, 0.95f * y, m->height - cover});
}

// Open, its screen at -y and leaning back; the user sits at +y.
void DrawLaptop(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  const float base = std::min(0.018f, 0.2f * m->height);
  m->Use(Material::kMetal, m->color);
  m->Box({-x, -0.75f * y, 0.0f}, {x, y, base}, 0.003f);
  TriangleMesh lid;
  AddCutBox({-x, -0.005f, 0.0f}, {x, 0.005f, 1.03f * m->height}, 0.003f, &lid);
  TriangleMesh picture;
  AddBox({-x + 0.01f, 0.005f, 0.015f}, {x - 0.01f, 0.006f, m->height}, &picture);
  const Eigen::Affine3f lean = Eigen::Translation3f(0.0f, -0.72f * y, 0.5f * base) *
                               Eigen::AngleAxisf(0.22f, Vector3f::UnitX());
  Transform(lean, &lid);
  Transform(lean, &picture);
  m->mesh()->Append(lid);
  m->Use(Material::kPaper, {108, 132, 158, 255});
  m->mesh()->Append(picture);
  m->Use(Material::kBooks, kDark);
  m->Box({-0.9f * x, -0.6f * y, base}, {0.9f * x, 0.3f * y, base + 0.001f});
}

void DrawWhiteboard(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  m->Use(Material::kPaper, {236, 238, 238, 255});
  m->Box({-x + 0.02f, -y, 0.03f}, {x - 0.02f, 0.0f, m->height - 0.02f});
  m->Use(Material::kMetal, kSteel);
  m->Box({-x, -y, m->height - 0.03f}, {x, 0.3f * y, m->height});
  m->Box({-x, -y, 0.0f}, {-x + 0.03f, 0.3f * y, m->height});
  m->Box({x - 0.03f, -y, 0.0f}, {x, 0.3f * y, m->height});
  m->Box({-x, -y, 0.0f}, {x, y, 0.035f});
}

void DrawPicture(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  const float frame = std::min(0.04f, 0.2f * x);
  m->Use(Material::kPaper, m->color);
  m->Box({-x + frame, -y, frame}, {x - frame, 0.4f * y, m->height - frame});
  m->Use(Material::kWood, Scaled(m->color, 0.45));
  m->Box({-x, -y, 0.0f}, {x, y, frame}, 0.004f);
  m->Box({-x, -y, m->height - frame}, {x, y, m->height}, 0.004f);
  m->Box({-x, -y, 0.0f}, {-x + frame, y, m->height}, 0.004f);
  m->Box({x - frame, -y, 0.0f}, {x, y, m->height}, 0.004f);
}

void DrawPlant(Model* m) {
  const float radius = 0.5f * std::min(m->width, m->depth);
  const float pot = 0.28f * m->height;
  m->Use(Material::kTiles, {172, 104, 74, 255});
  AddTurned({{0.0f, 0.0f},
             {0.5f * radius, 0.0f},
             {0.72f * radius, pot},
             {0.62f * radius, pot},
             {0.6f * radius, 0.9f * pot},
             {0.0f, 0.9f * pot}},
            Vector3f::Zero(), Vector2f::Ones(), 16, m->mesh());
  m->Use(Material::kWood, {104, 84, 54, 255});
  m->Cylinder({0.0f, 0.0f, 0.8f * pot}, 0.02f, 0.7f * m->height - 0.8f * pot, 8);
  constexpr int kLeafCount = 44;
  for (int i = 0; i < kLeafCount; ++i) {
    const float share = static_cast<float>(i) / (kLeafCount - 1);
    m->Use(Material::kLeaves, Scaled(m->color, i % 3 == 0 ? 1.15 : 0.9));
    const float z = pot + 0.15f * m->height * share + 0.42f * m->height * share;
    // The golden angle: leaves never stand above each other.
    AddLeaf({0.0f, 0.0f, z}, 2.39996f * static_cast<float>(i), radius * (1.0f - 0.35f * share),
            m->height * (0.08f + 0.07f * share), 0.5f * radius, m->mesh());
  }
}

}  // namespace

std::span<const ModelMaker> SmallModels() {
  static constexpr ModelMaker kModels[] = {
      {"cup", DrawCup},        {"bowl", DrawBowl},   {"bottle", DrawBottle},
      {"vase", DrawVase},      {"phone", DrawPhone}, {"book", DrawBook},
      {"laptop", DrawLaptop},  {"plant", DrawPlant}, {"whiteboard", DrawWhiteboard},
      {"picture", DrawPicture}};
  return kModels;
}

}  // namespace dsg::simulator
