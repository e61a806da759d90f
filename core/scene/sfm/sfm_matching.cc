#include "core/scene/sfm/sfm_matching.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <utility>

#include "core/base/files.h"
#include "core/scene/sfm/descriptor_matches.h"
#include "core/scene/sfm/sfm_database.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// Photos of at least this size have enough features without being enlarged.
constexpr int kCoarseFromSidePx = 900;
// Pairs matched between two reports of progress.
constexpr size_t kPairsPerCall = 100;

// COLMAP's parameters f, cx, cy, k of a camera with known focal length.
std::string CameraParameters(const FeatureImages::Group& group) {
  return fmt::format(
      "{:.3f},{:.1f},{:.1f},0", group.focal_px, 0.5 * group.width, 0.5 * group.height);
}

void WriteLines(const fs::path& file, const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  WriteFileAtomic(file, text);
}

// Also removes the write-ahead log of an interrupted run, which SQLite would apply to the new
// database.
void RemoveDatabase(const SfmWorkspace& work) {
  for (const char* suffix : {"", "-wal", "-shm", "-journal"}) {
    std::error_code error;
    fs::remove(work.database().string() + suffix, error);
  }
}

// Descriptors of the photos in the pairs, by number; empty for all other photos.
std::map<int, SiftDescriptors> DescriptorsFor(const SfmWorkspace& work,
                                              const FeatureImages& photos,
                                              const std::vector<PhotoPair>& pairs) {
  SfmDatabase database(work.database());
  std::map<int, SiftDescriptors> descriptors;
  for (const PhotoPair& pair : pairs) {
    for (const int photo : {pair.first, pair.second}) {
      if (descriptors.contains(photo)) continue;
      descriptors.emplace(photo, SiftDescriptors(database.ReadDescriptors(photos.names[photo])));
    }
  }
  return descriptors;
}

// Matches of a pair in COLMAP's import format: the names, a line for each match, an empty line.
// Empty if there are too few matches.
std::string MatchesText(const FeatureImages& photos,
                        const PhotoPair& pair,
                        const std::vector<std::pair<int, int>>& matches) {
  constexpr size_t kFewest = 15;  // as in the mapper
  if (matches.size() < kFewest) return "";
  std::string text = photos.names[pair.first] + " " + photos.names[pair.second] + "\n";
  for (const auto& [x, y] : matches) text += fmt::format("{} {}\n", x, y);
  return text + "\n";
}

}  // namespace

bool ExtractFeatures(ColmapProcess& colmap,
                     const SfmWorkspace& work,
                     const FeatureImages& photos,
                     const ImportOptions& options,
                     FeatureDetail detail) {
  RemoveDatabase(work);
  bool any_coarse = false;
  for (const FeatureImages::Group& group : photos.groups) {
    const bool coarse = detail == FeatureDetail::kCoarse &&
                        std::max(group.width, group.height) >= kCoarseFromSidePx;
    any_coarse = any_coarse || coarse;
    const fs::path list = work.folder / "photos.txt";
    WriteLines(list, group.names);
    std::vector<std::string> arguments = {"feature_extractor",
                                          "--database_path",
                                          work.database().string(),
                                          "--image_path",
                                          work.images().string(),
                                          "--image_list_path",
                                          list.string(),
                                          "--ImageReader.camera_model",
                                          "SIMPLE_RADIAL",
                                          "--ImageReader.single_camera_per_folder",
                                          "1",
                                          "--SiftExtraction.use_gpu",
                                          "0",
                                          "--SiftExtraction.num_threads",
                                          colmap.Threads(),
                                          "--SiftExtraction.first_octave",
                                          coarse ? "0" : "-1",
                                          "--SiftExtraction.max_image_size",
                                          std::to_string(options.sfm_max_image_side_px),
                                          "--SiftExtraction.max_num_features",
                                          std::to_string(options.sfm_max_features)};
    if (photos.masked) {
      arguments.insert(arguments.end(), {"--ImageReader.mask_path", work.masks().string()});
    }
    if (group.focal_px > 0.0) {
      arguments.insert(arguments.end(), {"--ImageReader.camera_params", CameraParameters(group)});
    }
    colmap.RunOrThrow(
        arguments,
        {"finding features in photos", "Processed file", static_cast<int64_t>(group.names.size())});
  }
  SfmDatabase(work.database()).NumberPhotosByName();
  return any_coarse;
}

void MatchPairs(ColmapProcess& colmap,
                const SfmWorkspace& work,
                const FeatureImages& photos,
                const std::vector<PhotoPair>& pairs,
                const RunControl& run) {
  for (size_t begin = 0; begin < pairs.size(); begin += kPairsPerCall) {
    const size_t end = std::min(begin + kPairsPerCall, pairs.size());
    const std::vector<PhotoPair> some(pairs.begin() + static_cast<std::ptrdiff_t>(begin),
                                      pairs.begin() + static_cast<std::ptrdiff_t>(end));
    const std::string what =
        fmt::format("matching pairs of photos {}..{} of {}", begin, end, pairs.size());
    run.progress.OnProgress(static_cast<int64_t>(begin), static_cast<int64_t>(pairs.size()), what);
    const std::map<int, SiftDescriptors> descriptors = DescriptorsFor(work, photos, some);
    std::vector<std::string> texts(some.size());
    run.pool.ForEach(static_cast<int64_t>(some.size()), [&](int64_t i, int) {
      run.cancel.ThrowIfCancelled();
      const PhotoPair& pair = some[static_cast<size_t>(i)];
      texts[static_cast<size_t>(i)] = MatchesText(
          photos, pair, MatchDescriptors(descriptors.at(pair.first), descriptors.at(pair.second)));
    });
    std::string text;
    for (const std::string& of_pair : texts) text += of_pair;
    if (text.empty()) continue;
    const fs::path list = work.folder / "matches.txt";
    WriteFileAtomic(list, text);
    // COLMAP verifies pairs in sequence on one thread, so that its random numbers follow from the
    // seed.
    colmap.RunOrThrow({"matches_importer",
                       "--random_seed",
                       "0",
                       "--database_path",
                       work.database().string(),
                       "--SiftMatching.use_gpu",
                       "0",
                       "--SiftMatching.num_threads",
                       "1",
                       "--match_list_path",
                       list.string(),
                       "--match_type",
                       "raw"},
                      {what, ".png - ", static_cast<int64_t>(some.size())});
  }
}

}  // namespace color3d
