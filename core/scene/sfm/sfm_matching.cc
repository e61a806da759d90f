#include "core/scene/sfm/sfm_matching.h"

#include <fmt/core.h>

#include <algorithm>
#include <map>

#include "core/base/files.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// Photos at least this long have enough features without being enlarged.
constexpr int kCoarseFromSidePx = 900;
// Pairs per call: what happens between two reports of progress.
constexpr size_t kPairsPerCall = 100;
constexpr int kMatchingBlock = 10;

// COLMAP's parameters f, cx, cy, k of a camera with a known focal length.
std::string CameraParameters(const FeatureImages::Group& group) {
  return fmt::format(
      "{:.3f},{:.1f},{:.1f},0", group.focal_px, 0.5 * group.width, 0.5 * group.height);
}

void WriteLines(const fs::path& file, const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  WriteFileAtomic(file, text);
}

// With the log of a program that was stopped: SQLite would play it into the next database.
void RemoveDatabase(const SfmWorkspace& work) {
  for (const char* suffix : {"", "-wal", "-shm", "-journal"}) {
    std::error_code error;
    fs::remove(work.database().string() + suffix, error);
  }
}

std::vector<std::string> MatchingArguments(const ColmapProcess& colmap,
                                           const SfmWorkspace& work,
                                           const char* program) {
  return {program,
          "--database_path",
          work.database().string(),
          "--SiftMatching.use_gpu",
          "0",
          "--SiftMatching.num_threads",
          colmap.Threads()};
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
  return any_coarse;
}

void MatchPairs(ColmapProcess& colmap,
                const SfmWorkspace& work,
                const FeatureImages& photos,
                const std::vector<PhotoPair>& pairs) {
  for (size_t begin = 0; begin < pairs.size(); begin += kPairsPerCall) {
    const size_t end = std::min(begin + kPairsPerCall, pairs.size());
    std::vector<std::string> lines;
    for (size_t i = begin; i < end; ++i) {
      lines.push_back(photos.names[pairs[i].first] + " " + photos.names[pairs[i].second]);
    }
    const fs::path list = work.folder / "pairs.txt";
    WriteLines(list, lines);
    std::vector<std::string> arguments = MatchingArguments(colmap, work, "matches_importer");
    arguments.insert(arguments.end(),
                     {"--match_list_path", list.string(), "--match_type", "pairs"});
    colmap.RunOrThrow(
        arguments,
        {fmt::format("matching pairs of photos {}..{} of {}", begin, end, pairs.size()),
         "Matching block",
         1});
  }
}

void MatchAllPairs(ColmapProcess& colmap, const SfmWorkspace& work, size_t count) {
  const int64_t blocks = static_cast<int64_t>(count + kMatchingBlock - 1) / kMatchingBlock;
  std::vector<std::string> arguments = MatchingArguments(colmap, work, "exhaustive_matcher");
  arguments.insert(arguments.end(),
                   {"--ExhaustiveMatching.block_size", std::to_string(kMatchingBlock)});
  colmap.RunOrThrow(arguments, {"matching blocks of photos", "Matching block", blocks * blocks});
}

}  // namespace color3d
