#include "core/catalogue/pose_files.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "core/catalogue/scene_files.h"

namespace color3d {
namespace {

constexpr const char* kStems[] = {"cameras", "images", "points3D"};
constexpr const char* kEndings[] = {".bin", ".txt"};
constexpr int kElsewhere = 3;

std::pair<std::string, std::string> FolderAndName(const std::string& path) {
  const size_t slash = path.rfind('/');
  if (slash == std::string::npos) return {"", path};
  return {path.substr(0, slash), path.substr(slash + 1)};
}

bool IsNumber(std::string_view part) {
  return !part.empty() && part.find_first_not_of("0123456789") == part.npos;
}

// 0 to 2 for the places where programs put their model, the most usual first; else kElsewhere.
int RankOf(const std::string& folder) {
  static const std::set<std::string_view> kParts = {"sparse",
                                                    "colmap",
                                                    "colmap_sparse",
                                                    "colmap_text",
                                                    "text",
                                                    "dense",
                                                    "undistorted",
                                                    "model",
                                                    "models"};
  if (folder.empty()) return 2;
  std::string_view rest = folder;
  bool is_first = true;
  while (!rest.empty()) {
    const size_t end = std::min(rest.find('/'), rest.size());
    const std::string_view part = rest.substr(0, end);
    if (!kParts.contains(part) && (is_first || !IsNumber(part))) return kElsewhere;
    rest.remove_prefix(std::min(end + 1, rest.size()));
    is_first = false;
  }
  return folder.starts_with("sparse") ? 0 : 1;
}

ColmapPlace PlaceOf(const std::string& folder, const std::set<std::string>& names) {
  ColmapPlace place;
  place.folder = folder;
  const std::string prefix = folder.empty() ? "" : folder + "/";
  for (const char* ending : kEndings) {
    std::vector<std::string> files;
    for (const char* stem : kStems) {
      const std::string name = std::string(stem) + ending;
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
    const auto [folder, name] = FolderAndName(file);
    for (const char* stem : kStems) {
      for (const char* ending : kEndings) {
        if (name == std::string(stem) + ending) folders[folder].insert(name);
      }
    }
  }
  // By tier: whole and usual, whole, parts. A lonely images.txt is a list, no part of a model.
  std::map<int, std::vector<std::pair<int, ColmapPlace>>> tiers;
  for (const auto& [folder, names] : folders) {
    const int rank = RankOf(folder);
    ColmapPlace place = PlaceOf(folder, names);
    const bool has_cameras = names.contains("cameras.bin") || names.contains("cameras.txt");
    if (!has_cameras && names.size() < 2) continue;
    const int tier = !place.whole ? 2 : rank == kElsewhere ? 1 : 0;
    tiers[tier].emplace_back(rank, std::move(place));
  }
  std::vector<ColmapPlace> places;
  if (tiers.empty()) return places;
  auto& first = tiers.begin()->second;
  // "sparse/0" before "sparse".
  const auto key = [](const std::pair<int, ColmapPlace>& place) {
    return std::pair(place.first, place.second.folder + "/\x7f");
  };
  std::ranges::sort(first, {}, key);
  for (auto& [rank, place] : first) places.push_back(std::move(place));
  return places;
}

bool IsTransformsFile(std::string_view path) {
  const std::string_view name = path.substr(path.rfind('/') + 1);
  return name == kTransformsFile ||
         std::ranges::find(kBlenderFiles, name) != std::end(kBlenderFiles);
}

}  // namespace color3d
