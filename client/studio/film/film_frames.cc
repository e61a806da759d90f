#include "client/studio/film/film_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "client/lib/photos/photo_color.h"
#include "client/studio/found_photos.h"
#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/text/utf8.h"
#include "core/catalogue/film_rate.h"
#include "core/image/codec.h"
#include "core/video/film_reader.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;
constexpr size_t kOpenFilms = 3;
constexpr size_t kKeptFrames = 48;
constexpr int kFrameQuality = 88;  // of their JPEG
constexpr int kJudgedFrames = 5;   // looked at for colour

[[noreturn]] void NoFrame(const std::string& view) {
  throw Error(
      ErrorCode::kNotFound, "the film has no frame {}", EscapeControls(CleanUtf8(view, 200)));
}

// 12 for "f000012", with or without an ending.
int FrameOfView(const std::string& view) {
  const std::string stem = fs::path(view).stem().string();
  int frame = -1;
  if (stem.size() < 2 || stem[0] != 'f' || view.find('/') != view.npos) NoFrame(view);
  const auto [end, error] = std::from_chars(stem.data() + 1, stem.data() + stem.size(), frame);
  if (error != std::errc() || end != stem.data() + stem.size() || frame < 0) NoFrame(view);
  return frame;
}

double RateOf(const std::vector<double>& times, double seconds) {
  if (times.size() > 1 && times.back() > times.front()) {
    return static_cast<double>(times.size() - 1) / (times.back() - times.front());
  }
  return seconds > 0.0 ? 1.0 / seconds : kDefaultFramesPerSecond;
}

}  // namespace

struct FilmFrames::OpenFilm {
  fs::path file;
  fs::file_time_type changed;
  Mutex mutex;
  std::optional<FilmReader> reader COLOR3D_GUARDED_BY(mutex);
};

std::shared_ptr<FilmFrames::OpenFilm> FilmFrames::Open(const fs::path& film) {
  std::error_code error;
  const auto changed = fs::last_write_time(film, error);
  if (error) throw Error(ErrorCode::kNotFound, "the film {} is gone", film.string());
  const MutexLock lock(mutex_);
  const auto found = std::ranges::find_if(
      open_, [&](const auto& open) { return open->file == film && open->changed == changed; });
  if (found != open_.end()) {
    open_.splice(open_.begin(), open_, found);
  } else {
    auto opened = std::make_shared<OpenFilm>();
    opened->file = film;
    opened->changed = changed;
    open_.push_front(std::move(opened));
    if (open_.size() > kOpenFilms) open_.pop_back();
  }
  return open_.front();
}

Image FilmFrames::Read(const fs::path& film, int frame) {
  const std::shared_ptr<OpenFilm> open = Open(film);
  const MutexLock lock(open->mutex);
  if (!open->reader) open->reader.emplace(film, &cancel_);
  if (frame < 0 || frame >= static_cast<int>(open->reader->times().size())) {
    throw Error(ErrorCode::kNotFound,
                "the film has {} frames; there is no frame {}",
                open->reader->times().size(),
                frame);
  }
  return open->reader->Read(frame);
}

Json FilmFrames::Describe(const PhotoFolder& folder) {
  if (!folder.film) {
    const Json found = DescribePhotos(folder, cancel_);
    const auto& first = found.at("photos").at(0);
    const auto frames = static_cast<double>(folder.photos.size());
    return {{"frames", folder.photos.size()},
            {"seconds", frames / kDefaultFramesPerSecond},
            {"frames_per_second", kDefaultFramesPerSecond},
            {"width", first.value("width", 0)},
            {"height", first.value("height", 0)},
            {"codec", ""},
            {"has_sound", false},
            {"in_color", found.at("in_color")},
            {"is_video", false},
            {"notes", found.at("notes")}};
  }
  const std::shared_ptr<OpenFilm> open = Open(folder.film->file);
  const MutexLock lock(open->mutex);
  if (!open->reader) open->reader.emplace(open->file, &cancel_);
  const FilmFacts& facts = open->reader->facts();
  const std::vector<double>& times = open->reader->times();
  Json notes = folder.notes;
  for (const std::string& note : facts.notes) notes.push_back("The film " + note);
  int judged = 0, in_color = 0;
  for (int i = 0; i < kJudgedFrames; ++i) {
    const int frame = static_cast<int>((2 * i + 1) * times.size() / (2 * kJudgedFrames));
    try {
      in_color += HasColor(FitWithin(open->reader->Read(frame), 400)) ? 1 : 0;
      ++judged;
    } catch (const Error& e) {
      if (e.code() != ErrorCode::kDataLoss) throw;
    }
  }
  const bool is_sure = judged > 0 && (in_color == 0 || in_color == judged);
  return {{"frames", times.size()},
          {"seconds", facts.seconds},
          {"frames_per_second", RateOf(times, facts.seconds)},
          {"width", facts.width},
          {"height", facts.height},
          {"codec", facts.codec},
          {"has_sound", facts.has_sound},
          {"in_color", is_sure ? Json(in_color > 0) : Json()},
          {"is_video", true},
          {"notes", notes}};
}

std::string FilmFrames::Jpeg(const PhotoFolder& folder,
                             const std::string& view,
                             int max_side_px,
                             bool gray) {
  if (!folder.film) return PhotoJpeg(PhotoOfView(folder, view), max_side_px, gray);
  return JpegOfFile(folder.film->file, FrameOfView(view), max_side_px, gray);
}

std::string FilmFrames::JpegOfFile(const fs::path& film, int frame, int max_side_px, bool gray) {
  return PictureJpeg(Read(film, frame), max_side_px, gray, kFrameQuality);
}

LocalFile FilmFrames::File(const PhotoFolder& folder, const std::string& view) {
  if (!folder.film) return PhotoOfView(folder, view);
  const int frame = FrameOfView(view);
  const std::string name = fmt::format("f{:06}.png", frame);
  const fs::path file =
      scratch_.path() / Sha256Hex(folder.film->file.string()).substr(0, 16) / name;
  std::error_code none;
  if (!fs::exists(file, none)) {
    const Image picture = Read(folder.film->file, frame);
    fs::create_directories(file.parent_path());
    WriteFileAtomic(file, EncodePng8(picture));
  }
  const MutexLock lock(mutex_);
  files_.remove(file);
  files_.push_front(file);
  if (files_.size() > kKeptFrames) {
    fs::remove(files_.back(), none);
    files_.pop_back();
  }
  return {name, file};
}

}  // namespace color3d::client
