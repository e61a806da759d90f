// Fuzz target: COLMAP's models, and the times of their photos. The first byte selects text, binary
// or times.txt, the next ones are the ends of the files cameras, images and points3D.
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "core/base/files.h"
#include "core/scene/formats/colmap_model.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/support/memory_folder.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;

constexpr std::array<const char*, 3> kFiles = {"cameras", "images", "points3D"};
constexpr size_t kHead = 5;
constexpr char kBinary = 1, kTimes = 2;  // else text

size_t Number(const uint8_t* bytes) { return bytes[0] | bytes[1] << 8; }

std::string Input(bool binary, const std::array<std::string, 3>& files) {
  std::string input(1, binary ? kBinary : '\0');
  for (int f = 0; f < 2; ++f) {
    input += static_cast<char>(files[f].size() & 255u);
    input += static_cast<char>(files[f].size() >> 8u);
  }
  return input + files[0] + files[1] + files[2];
}

// Little-endian numbers, one after another.
template <class... Values>
std::string Binary(const Values&... values) {
  std::string bytes;
  (bytes.append(reinterpret_cast<const char*>(&values), sizeof(values)), ...);
  return bytes;
}

std::string Times(const std::string& text) { return std::string(1, kTimes) + "...." + text; }

int ReadTimes(const fs::path& file, std::string_view text) {
  std::ofstream(file, std::ios::binary) << text;
  return ReadOrRefuse([&] {
    std::vector<FrameTime> times;
    for (const auto& [name, time] : LoadColmapTimes(file)) times.push_back(time);
    for (const std::optional<Moment>& moment : AssignMoments(times).moments) {
      if (moment && !std::isfinite(moment->time_s)) std::abort();
    }
  });
}

}  // namespace

std::vector<std::string> FuzzSeeds() {
  const std::array<std::string, 3> text = {
      "# comment\n1 PINHOLE 640 480 500 500 320 240\n2 SIMPLE_RADIAL 64 48 50 32 24 0.01\n",
      "1 1 0 0 0 0.5 0 1 1 a.jpg\n10 20 1 30 40 -1\n2 0.9 0.1 0 0 0 0 2 2 b c.jpg\n\n",
      "1 0.5 0.25 4 128 128 128 0.7 1 0 2 0\n"};
  const std::string cameras = Binary(uint64_t{1},
                                     uint32_t{1},
                                     int32_t{1},
                                     uint64_t{640},
                                     uint64_t{480},
                                     500.0,
                                     500.0,
                                     320.0,
                                     240.0);
  const std::string images =
      Binary(uint64_t{1}, uint32_t{1}, 1.0, 0.0, 0.0, 0.0, 0.5, 0.0, 1.0, uint32_t{1}) +
      std::string("a.jpg\0", 6) + Binary(uint64_t{1}, 10.0, 20.0, uint64_t{1});
  const std::string points = Binary(uint64_t{1},
                                    uint64_t{1},
                                    0.5,
                                    0.25,
                                    4.0,
                                    uint8_t{128},
                                    uint8_t{128},
                                    uint8_t{128},
                                    0.7,
                                    uint64_t{1},
                                    uint32_t{1},
                                    uint32_t{0});
  // With a byte order mark, a line per photo, fractions, and a number beyond the range of double.
  const std::array<std::string, 3> foreign = {
      "\xef\xbb\xbf# comment\n1.0 PINHOLE 640.0 480.0 500 500 320 240\n",
      "1 1 0 0 0 0.5 0 1 1 l\\a.jpg\n2 1 0 0 0 0 0 2 1 0002\nnan 20 18446744073709551615\n",
      "1 0.5 0.25 4 154.0 128.0 1e2 nan 1 0 2 0.0\n2 0 0 1\n"};
  return {Input(false, text),
          Input(false, foreign),
          Input(true, {cameras, images, points}),
          Input(true, {"", "", ""}),
          Times("# comment\n\n0 l/a b.jpg\r\n0 r/a.jpg\n+0.04 l/c.jpg\n"),
          Times("\xef\xbb\xbf"
                "0 l\\a.jpg\n1 b\n"),
          Times("-1e308 a\n1e308 b\nnan c\n")};
}

}  // namespace color3d

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace color3d;
  if (size < kHead) return 0;
  static const ScratchFolder folder(MemoryFolder());
  const bool binary = (data[0] & kBinary) != 0;
  std::string_view rest(reinterpret_cast<const char*>(data) + kHead, size - kHead);
  if ((data[0] & kTimes) != 0) return ReadTimes(folder.path() / "times.txt", rest);
  for (size_t f = 0; f < kFiles.size(); ++f) {
    const size_t length = f < 2 ? std::min(Number(data + 1 + 2 * f), rest.size()) : rest.size();
    const fs::path file = folder.path() / (std::string(kFiles[f]) + (binary ? ".bin" : ".txt"));
    std::ofstream(file, std::ios::binary) << rest.substr(0, length);
    rest.remove_prefix(length);
  }
  return ReadOrRefuse([&] {
    const ColmapModel model =
        binary ? LoadColmapBinary(folder.path()) : LoadColmapText(folder.path());
    for (const auto& [id, image] : model.images) {
      if (!image.cam_from_world.Center().allFinite()) std::abort();
    }
    for (const ColmapPoint& point : model.points) {
      if (!point.position.allFinite()) std::abort();
    }
  });
}
