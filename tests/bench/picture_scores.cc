#include "tests/bench/picture_scores.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/codec.h"
#include "core/image/probe/probe.h"
#include "core/metrics/view_scores.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr double kShapeTolerance = 0.02;

// Pictures directly in the folder, by stem.
std::map<std::string, fs::path> PicturesByStem(const fs::path& folder) {
  if (!IsFolder(folder)) {
    throw Error(ErrorCode::kNotFound, "there is no folder {}", folder.string());
  }
  std::map<std::string, fs::path> found;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with('.') || !IsFile(entry.path()) || !HasImageExtension(name)) continue;
    const auto [other, is_new] = found.emplace(entry.path().stem().string(), entry.path());
    if (!is_new) {
      throw InvalidArgument("{} has {} and {}: give one picture a view",
                            folder.string(),
                            other->second.filename().string(),
                            name);
    }
  }
  if (found.empty()) {
    throw InvalidArgument("{} has no pictures ({})", folder.string(), ReadableImageFormats());
  }
  return found;
}

// Stem of the photo with this stem or name.
std::string FindPhoto(const std::string& view,
                      const std::map<std::string, fs::path>& photos,
                      const fs::path& folder) {
  for (const std::string& stem : {view, fs::path(view).stem().string()}) {
    if (photos.contains(stem)) return stem;
  }
  throw InvalidArgument("{} has no photo {}", folder.string(), view);
}

Image ReadColor(const fs::path& file) {
  Image image = ReadImage(file);
  if (image.channels == 3) return image;
  Image color(image.width, image.height, 3);
  for (int c = 0; c < 3; ++c) std::copy_n(image.Plane(0), image.PlaneSize(), color.Plane(c));
  return color;
}

std::map<std::string, double> Score(const fs::path& photo, const fs::path& picture) {
  const Image truth = ReadColor(photo);
  if (IsGray(truth)) {
    throw InvalidArgument(
        "{} is grey, and grey photos cannot score colours; give the photos in "
        "their true colours",
        photo.string());
  }
  const Image given = ReadColor(picture);
  const double shape = static_cast<double>(given.width) * truth.height /
                       (static_cast<double>(given.height) * truth.width);
  if (std::abs(shape - 1.0) > kShapeTolerance) {
    throw InvalidArgument(
        "{} has {} x {} px, but its photo {} has {} x {}: pictures may be smaller "
        "than the photos, not of another shape",
        picture.string(),
        given.width,
        given.height,
        photo.filename().string(),
        truth.width,
        truth.height);
  }
  // Both are reduced before the picture is fitted to the truth, so that large photos cost nothing.
  const Image small = FitWithin(truth, kScoreSidePx);
  const Image lab = LabFromSrgb(Resize(given, small.width, small.height));
  return ScoreView(small, lab, ChromaOfLab(lab));
}

}  // namespace

std::vector<PictureScores> ScorePictures(const fs::path& truth,
                                         const fs::path& pictures,
                                         const std::vector<std::string>& views,
                                         ThreadPool& pool,
                                         const CancellationToken& cancel) {
  const auto photos = PicturesByStem(truth), given = PicturesByStem(pictures);
  for (const auto& [stem, picture] : given) {
    if (photos.contains(stem)) continue;
    throw InvalidArgument(
        "{} has no photo of its name in {}: are these the pictures of another "
        "scene?",
        picture.string(),
        truth.string());
  }
  std::vector<std::string> selected;
  for (const std::string& view : views) selected.push_back(FindPhoto(view, photos, truth));
  for (const auto& [stem, picture] : given) {
    if (views.empty()) selected.push_back(stem);
  }
  std::string missing;
  size_t count = 0;
  for (const std::string& stem : selected) {
    if (given.contains(stem)) continue;
    if (count++ < 5) missing += (missing.empty() ? "" : ", ") + stem;
  }
  if (count > 0) {
    throw InvalidArgument("{} has no picture of {} of the {} scored views: {}{}",
                          pictures.string(),
                          count,
                          selected.size(),
                          missing,
                          count > 5 ? ", ..." : "");
  }
  std::vector<PictureScores> scores(selected.size());
  pool.ForEach(static_cast<int64_t>(selected.size()), [&](int64_t i, int) {
    cancel.ThrowIfCancelled();
    const std::string& stem = selected[static_cast<size_t>(i)];
    scores[static_cast<size_t>(i)] = {
        stem, Score(photos.at(stem), given.at(stem)), photos.at(stem), given.at(stem)};
  });
  return scores;
}

}  // namespace color3d
