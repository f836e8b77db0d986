// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "ingest/objects/shapes/cad_model.h"
#include "ingest/objects/shapes/mesh_file.h"
#include "ingest/objects/shapes/mesh_file_internal.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"

namespace dsg::ingest {
namespace {

constexpr double kSizeMaxM = 50.0;
constexpr double kSizeMinM = 0.02;
// Files whose origin is this near are kept as they are, with the rounding of their decimals.
constexpr double kOriginToleranceM = 1e-4;
constexpr int64_t kJsonBytesMax = 1 << 20;

struct Entry {
  std::string class_name;
  char up = 'z';
  double scale = 1.0;
};

using Entries = std::map<std::string, Entry>;

absl::StatusOr<std::string> ReadBytes(const std::filesystem::path& path, int64_t bytes_max) {
  std::error_code error;
  const uintmax_t size = std::filesystem::file_size(path, error);
  if (error) return CadFileError(path.string(), absl::StrCat("cannot be read: ", error.message()));
  if (size == 0) return CadFileError(path.string(), "is empty; was the copy cut short?");
  if (size > static_cast<uintmax_t>(bytes_max)) {
    return CadFileError(path.string(), absl::StrCat("has ", size, " bytes, more than ", bytes_max,
                                                    "; simplify the model"));
  }
  std::string bytes(size, '\0');
  std::ifstream in(path, std::ios::binary);
  in.read(bytes.data(), static_cast<std::streamsize>(size));
  if (!in) return CadFileError(path.string(), "cannot be read whole; check its permissions");
  return bytes;
}

std::string EndingOf(const std::filesystem::path& path) {
  return absl::AsciiStrToLower(path.extension().string());
}

std::string ClassFromName(const std::string& file) {
  std::string name = file.substr(0, file.find_first_of("_."));
  std::replace(name.begin(), name.end(), '-', ' ');
  return name;
}

absl::Status EntryError(const std::string& path, size_t index, const std::string& message) {
  return CadFileError(path, absl::StrCat("models[", index, "]: ", message));
}

absl::Status ParseEntry(const nlohmann::json& in, const std::string& path, size_t index,
                        Entries* entries) {
  if (!in.is_object()) return EntryError(path, index, "is no object");
  std::string file;
  Entry entry;
  for (const auto& [key, value] : in.items()) {
    if (key == "file" && value.is_string()) {
      file = value.get<std::string>();
    } else if (key == "class" && value.is_string()) {
      entry.class_name = value.get<std::string>();
    } else if (key == "up" && (value == "y" || value == "z")) {
      entry.up = value.get<std::string>().front();
    } else if (key == "scale" && value.is_number() && value.get<double>() > 0.0) {
      entry.scale = value.get<double>();
    } else {
      return EntryError(path, index,
                        absl::StrCat(Quoted(key), " is ", Quoted(value.dump(-1, ' ', true)),
                                     "; there are \"file\" and \"class\" (text), \"up\" (\"y\" or "
                                     "\"z\") and \"scale\" (a number above 0)"));
    }
  }
  if (file.empty()) return EntryError(path, index, "has no \"file\"");
  if (!entries->emplace(file, entry).second) {
    return EntryError(path, index, absl::StrCat(Quoted(file), " is listed twice"));
  }
  return absl::OkStatus();
}

absl::StatusOr<Entries> ReadEntries(const std::filesystem::path& path) {
  Entries entries;
  if (!std::filesystem::exists(path)) return entries;
  DSG_ASSIGN_OR_RETURN(const std::string bytes, ReadBytes(path, kJsonBytesMax));
  const nlohmann::json json = nlohmann::json::parse(bytes, nullptr, false);
  if (json.is_discarded()) return CadFileError(path.string(), "is no JSON");
  const auto models = json.is_object() ? json.find("models") : json.end();
  if (!json.is_object() || models == json.end() || !models->is_array()) {
    return CadFileError(path.string(), "has no list \"models\"");
  }
  for (size_t i = 0; i < models->size(); ++i) {
    DSG_RETURN_IF_ERROR(ParseEntry((*models)[i], path.string(), i, &entries));
  }
  return entries;
}

// Rejects what no surface can be sampled from.
absl::Status CheckMesh(const TriangleSoup& mesh, const std::string& path, double scale) {
  if (mesh.faces.empty()) {
    return CadFileError(path, "has no faces; points alone are no shape");
  }
  Box3d box;
  double area = 0.0;
  for (const auto& [a, b, c] : mesh.faces) {
    for (const uint32_t corner : {a, b, c}) box.extend(mesh.vertices[corner]);
    area += (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).norm();
  }
  const double edge = box.sizes().maxCoeff() * scale;
  if (!(edge <= kSizeMaxM) || edge < kSizeMinM) {
    return CadFileError(path, absl::StrCat("is ", edge, " m long, outside ", kSizeMinM, " to ",
                                           kSizeMaxM, " m; set \"scale\" in catalogue.json"));
  }
  if (!(area > 0.0)) return CadFileError(path, "all its faces are without area");
  return absl::OkStatus();
}

// Turns, scales and moves the vertices. Returns whether anything changed.
bool Normalise(const Entry& entry, TriangleSoup* mesh) {
  for (Eigen::Vector3d& vertex : mesh->vertices) {
    if (entry.up == 'y') vertex = Eigen::Vector3d(vertex.x(), -vertex.z(), vertex.y());
    vertex *= entry.scale;
  }
  Box3d box;
  for (const auto& face : mesh->faces) {
    for (const uint32_t corner : face) box.extend(mesh->vertices[corner]);
  }
  const Eigen::Vector3d origin(box.center().x(), box.center().y(), box.min().z());
  if (entry.up == 'z' && entry.scale == 1.0 && origin.norm() <= kOriginToleranceM) return false;
  // Rounded as they will be stored, so that whoever reads the asset has the same numbers.
  for (Eigen::Vector3d& vertex : mesh->vertices) {
    vertex = (vertex - origin).cast<float>().cast<double>();
  }
  return true;
}

absl::StatusOr<CadModel> ReadModel(const std::filesystem::path& path, const Entry& entry) {
  DSG_ASSIGN_OR_RETURN(std::string bytes, ReadBytes(path, kCadFileBytesMax));
  const bool is_ply = EndingOf(path) == ".ply";
  DSG_ASSIGN_OR_RETURN(TriangleSoup mesh,
                       is_ply ? ReadPly(bytes, path.string()) : ReadObj(bytes, path.string()));
  DSG_RETURN_IF_ERROR(CheckMesh(mesh, path.string(), entry.scale));
  CadModel model;
  model.name = path.stem().string();
  model.class_name = entry.class_name;
  model.asset.media_type = is_ply ? "model/ply" : "model/obj";
  if (Normalise(entry, &mesh)) {
    bytes = WritePly(mesh);
    model.asset.media_type = "model/ply";
  }
  model.vertices = std::move(mesh.vertices);
  model.faces = std::move(mesh.faces);
  model.asset.sha256 = ComputeSha256(bytes);
  model.asset.content = std::move(bytes);
  return model;
}

absl::StatusOr<std::vector<std::filesystem::path>> ListModels(const std::string& folder) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    return absl::NotFoundError(
        absl::StrCat("CAD folder \"", folder, "\" does not exist; check the path"));
  }
  std::vector<fs::path> paths;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const std::string ending = EndingOf(it->path());
    std::error_code type_error;
    if ((ending == ".ply" || ending == ".obj") && it->is_regular_file(type_error)) {
      paths.push_back(it->path());
    }
  }
  if (error) return CadFileError(folder, absl::StrCat("cannot be listed: ", error.message()));
  if (paths.empty()) return CadFileError(folder, "holds no .ply or .obj file");
  std::sort(paths.begin(), paths.end());
  return paths;
}

}  // namespace

absl::StatusOr<std::vector<CadModel>> ReadCatalogue(const std::string& folder) {
  DSG_ASSIGN_OR_RETURN(const std::vector<std::filesystem::path> paths, ListModels(folder));
  const std::filesystem::path json_path = std::filesystem::path(folder) / "catalogue.json";
  DSG_ASSIGN_OR_RETURN(Entries entries, ReadEntries(json_path));
  std::vector<CadModel> models;
  for (const std::filesystem::path& path : paths) {
    const std::string file = path.filename().string();
    Entry entry;
    if (const auto found = entries.find(file); found != entries.end()) {
      entry = found->second;
      entries.erase(found);
    }
    if (entry.class_name.empty()) entry.class_name = ClassFromName(file);
    DSG_ASSIGN_OR_RETURN(CadModel model, ReadModel(path, entry));
    models.push_back(std::move(model));
  }
  if (!entries.empty()) {
    return CadFileError(json_path.string(), absl::StrCat("lists ", Quoted(entries.begin()->first),
                                                         ", which the folder does not hold"));
  }
  return models;
}

}  // namespace dsg::ingest
