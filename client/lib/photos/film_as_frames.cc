#include "client/lib/photos/film_as_frames.h"

#include <fmt/core.h>

#include <algorithm>

#include "client/lib/photos/photo_color.h"
#include "core/base/error.h"
#include "core/base/files.h"
#include "core/catalogue/scene_files.h"
#include "core/image/codec.h"
#include "core/video/film_reader.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

constexpr int kInspectedFrames = 5;
constexpr size_t kFewestFrames = 3;

// Returns a decodable frame; nullopt if it is damaged.
std::optional<Image> ReadUndamaged(FilmReader* film, int frame) {
  try {
    return film->Read(frame);
  } catch (const Error& e) {
    if (e.code() != ErrorCode::kDataLoss) throw;
    return std::nullopt;
  }
}

// Checked before all frames are decoded.
void RequireColor(FilmReader* film, int frames, const std::string& name) {
  int looked_at = 0, in_color = 0;
  for (int i = 0; i < kInspectedFrames; ++i) {
    const std::optional<Image> frame =
        ReadUndamaged(film, (2 * i + 1) * frames / (2 * kInspectedFrames));
    if (!frame) continue;
    ++looked_at;
    in_color += HasColor(*frame) ? 1 : 0;
  }
  if (2 * in_color > looked_at) return;
  throw InvalidArgument(
      "{} is monochrome ({} of {} frames inspected); --benchmark drops the colour of a film in "
      "colour and scores against it: leave it out",
      name,
      looked_at - in_color,
      looked_at);
}

}  // namespace

FilmAsFrames DecodeFilmFrames(const PhotoFolder& folder,
                              std::optional<double> end_s,
                              const fs::path& scratch,
                              const CancellationToken& cancel,
                              const std::function<void(int done, int total)>& on_frame) {
  const std::string name = folder.film->file.string();
  FilmReader film(folder.film->file, &cancel);
  const std::vector<double>& times = film.times();
  const auto end = end_s ? std::ranges::lower_bound(times, *end_s) : times.end();
  const auto count = static_cast<size_t>(end - times.begin());
  if (count > kMostBenchmarkFrames) {
    throw InvalidArgument(
        "{} has {} frames, and --benchmark takes {}: take its first {:.0f} s (--set "
        "import_scene.film_end_s={:.0f})",
        name,
        count,
        kMostBenchmarkFrames,
        times[kMostBenchmarkFrames],
        times[kMostBenchmarkFrames]);
  }
  if (count < kFewestFrames) {
    throw InvalidArgument("{} has {} frames{}; --benchmark needs at least {}",
                          name,
                          count,
                          end_s ? fmt::format(" before {} s (film_end_s)", *end_s) : "",
                          kFewestFrames);
  }
  const int frames = static_cast<int>(count);
  RequireColor(&film, frames, name);
  FilmAsFrames result;
  result.folder = folder;
  result.folder.film.reset();
  result.folder.root = folder.film->file;
  result.frames_per_second =
      std::clamp((static_cast<double>(count) - 1.0) / times[count - 1], 1.0, 120.0);
  fs::create_directories(scratch / kFramesFolder);
  int damaged = 0;
  for (int i = 0; i < frames; ++i) {
    on_frame(i, frames);
    const std::optional<Image> frame = ReadUndamaged(&film, i);
    if (!frame) {
      ++damaged;
      continue;
    }
    const std::string path = fmt::format("{}f{:06}.png", kFramesFolder, i);
    WriteFileAtomic(scratch / path, EncodePng8(*frame));
    result.folder.photos.push_back({path, scratch / path});
  }
  for (const std::string& note : film.facts().notes) {
    result.folder.notes.push_back(name + " " + note);
  }
  if (damaged > 0) {
    result.folder.notes.push_back(
        fmt::format("{} of {} frames of {} are damaged and left out", damaged, frames, name));
  }
  if (!film.facts().constant_rate) {
    result.folder.notes.push_back(fmt::format(
        "the frames of {} have uneven times; the benchmark shows {:.2f} a second evenly",
        name,
        result.frames_per_second));
  }
  return result;
}

}  // namespace color3d::client
