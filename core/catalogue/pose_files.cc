#include "core/catalogue/pose_files.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "core/catalogue/scene_files.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;

constexpr std::string_view kStems[] = {"cameras", "images", "points3D"};
constexpr std::string_view kEndings[] = {".bin", ".txt"};
constexpr int kElsewhere = 3;

// 0 to 2 for the places where programs put their model, the most usual first; else kElsewhere.
int RankOf(const fs::path& folder) {
  static const std::set<fs::path> kParts = {"sparse",
                                            "colmap",
                                            "colmap_sparse",
                                            "colmap_text",
                                            "text",
                                            "dense",
                                            "undistorted",
                                            "model",
                                            "models"};
  if (folder.empty()) return 2;
  for (auto part = folder.begin(); part != folder.end(); ++part) {
    const bool is_number = part->string().find_first_not_of("0123456789") == std::string::npos;
    if (!kParts.contains(*part) && (part == folder.begin() || !is_number)) return kElsewhere;
  }
  return folder.string().starts_with("sparse") ? 0 : 1;
}

ColmapPlace MakeColmapPlace(const std::string& folder, const std::set<std::string>& names) {
  ColmapPlace place;
  place.folder = folder;
  const std::string prefix = folder.empty() ? "" : folder + "/";
  for (const std::string_view ending : kEndings) {
    std::vector<std::string> files;
    for (const std::string_view stem : kStems) {
      const std::string name = fmt::format("{}{}", stem, ending);
      if (names.contains(name)) files.push_back(prefix + name);
    }
    if (files.size() == std::size(kStems)) return {folder, files, true};
    place.files.insert(place.files.end(), files.begin(), files.end());
  }
  return place;
}

}  // namespace

std::vector<ColmapPlace> ColmapPlaces(const std::vector<std::string>& files) {
  std::map<std::string, std::set<std::string>> folders;
  for (const std::string& file : files) {
    if (IsAugmentFile(file) || IsMaskFile(file) || IsFrameFile(file)) continue;
    const fs::path path = file;
    const std::string stem = path.stem().string();
    const std::string ending = path.extension().string();
    const bool is_part = std::ranges::find(kStems, stem) != std::end(kStems) &&
                         std::ranges::find(kEndings, ending) != std::end(kEndings);
    if (is_part) folders[path.parent_path().string()].insert(stem + ending);
  }
  // By tier (whole and usual, whole, parts), by rank, then "sparse/0" before "sparse".
  std::map<std::tuple<int, int, std::string>, ColmapPlace> found;
  for (const auto& [folder, names] : folders) {
    // A lonely images.txt is a list, no part of a model.
    const bool has_cameras = names.contains("cameras.bin") || names.contains("cameras.txt");
    if (!has_cameras && names.size() < 2) continue;
    const int rank = RankOf(folder);
    ColmapPlace place = MakeColmapPlace(folder, names);
    const int tier = !place.whole ? 2 : rank == kElsewhere ? 1 : 0;
    found[{tier, rank, folder + "/\x7f"}] = std::move(place);
  }
  std::vector<ColmapPlace> places;
  for (auto& [order, place] : found) {
    const int best_tier = std::get<0>(found.begin()->first);
    if (std::get<0>(order) == best_tier) places.push_back(std::move(place));
  }
  return places;
}

bool IsTransformsFile(std::string_view path) {
  const std::string_view name = path.substr(path.rfind('/') + 1);
  return name == kTransformsFile ||
         std::ranges::find(kBlenderFiles, name) != std::end(kBlenderFiles);
}

}  // namespace color3d
