// Fuzz target: video files, read through and then frame by frame, forward and backward.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/files.h"
#include "core/video/film_reader.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/support/formats/numbered_film.h"
#include "tests/support/formats/tone_film.h"
#include "tests/support/memory_folder.h"

namespace color3d {
namespace {

constexpr int64_t kDecodedPixels = 128 * 128;  // larger pictures are slow and test no more
constexpr int kFrames = 4;                     // number of frames to read

void CheckFrame(FilmReader& film, int frame) {
  try {
    const Image image = film.Read(frame);
    if (image.width != film.facts().width || image.height != film.facts().height) std::abort();
    for (const float sample : image.data) {
      if (!(sample >= 0.0f && sample <= 1.0f)) std::abort();
    }
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kDataLoss) throw;
  }
}

}  // namespace

std::vector<std::string> FuzzSeeds() {
  const ScratchFolder folder{MemoryFolder()};
  const std::pair<const char*, NumberedFilm> films[] = {
      {"a.mp4", {.frames = 5, .group = 3, .b_frames = 1, .is_flat = true}},
      {"a.mkv", {.encoder = "mpeg4", .frames = 4, .group = 2, .b_frames = 0, .is_flat = true}},
      {"a.avi",
       {.encoder = "mpeg4",
        .frames = 5,
        .group = 3,
        .b_frames = 1,
        .is_packed = true,
        .is_flat = true}},
      {"a.ts", {.encoder = "mpeg2video", .frames = 12, .group = 3, .b_frames = 1}},
      {"a.mpg",
       {.encoder = "mpeg2video", .frames = 3, .group = 3, .b_frames = 0, .is_flat = true}}};
  std::vector<std::string> seeds;
  const auto add = [&](const std::filesystem::path& file) {
    FilmReader(file).Read(0);  // throws if the seed is invalid
    seeds.push_back(ReadFile(file));
  };
  for (const auto& [name, film] : films) {
    const std::filesystem::path file = folder.path() / name;
    if (WriteNumberedFilm(file, film)) add(file);
  }
  WriteFieldFilm(folder.path() / "b.ts", 3, /*one_packet=*/false);
  add(folder.path() / "b.ts");
  const std::pair<const char*, std::vector<ToneStream>> toned[] = {
      {"c.mkv", {{.pixel_format = "gray", .width = 32, .height = 16}}},
      {"c.mov", {{.encoder = "png", .pixel_format = "ya8", .width = 32, .height = 16}}},
      {"d.mkv",
       {{.pixel_format = "yuv420p10le",
         .width = 32,
         .height = 16,
         .transfer = "smpte2084",
         .primaries = "bt2020"}}},
      {"e.mkv", {{.width = 32, .height = 16}, {.width = 16, .height = 16, .is_default = true}}}};
  for (const auto& [name, streams] : toned) {
    if (WriteToneFilm(folder.path() / name, streams)) add(folder.path() / name);
  }
  // Films that name other files, which must be refused.
  seeds.push_back("#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\nfilm\n#EXT-X-ENDLIST\n");
  seeds.push_back("ffconcat version 1.0\nfile film\n");
  return seeds;
}

}  // namespace color3d

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace color3d;
  static const ScratchFolder folder{MemoryFolder()};
  const std::filesystem::path file = folder.path() / "film";
  std::ofstream(file, std::ios::binary | std::ios::trunc)
      << std::string_view(reinterpret_cast<const char*>(data), size);
  return ReadOrRefuse([&] {
    FilmReader film(file);
    const std::vector<double>& times = film.times();
    if (times.empty() || times.front() != 0.0) std::abort();
    for (size_t i = 1; i < times.size(); ++i) {
      if (!(times[i] > times[i - 1])) std::abort();
    }
    const FilmFacts& facts = film.facts();
    if (!std::isfinite(facts.seconds) || facts.seconds < 0.0) std::abort();
    if (int64_t{facts.width} * facts.height > kDecodedPixels) return;
    const int frames = std::min(kFrames, static_cast<int>(times.size()));
    for (int i = 0; i < frames; ++i) CheckFrame(film, i);
    CheckFrame(film, static_cast<int>(times.size()) - 1);
    CheckFrame(film, 0);
  });
}
