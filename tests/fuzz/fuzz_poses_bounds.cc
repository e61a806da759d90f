// Fuzz target: NumPy files, and LLFF's poses_bounds.npy with films.
#include <cmath>
#include <fstream>
#include <limits>

#include "core/base/files.h"
#include "core/scene/formats/npy.h"
#include "core/scene/formats/poses_bounds.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/support/formats/npy_writer.h"
#include "tests/support/memory_folder.h"

namespace color3d {
namespace {

constexpr size_t kMaxValues = 1000;

// Two empty films, of which only the names are read.
const std::filesystem::path& FolderOfFilms() {
  static const ScratchFolder scratch(MemoryFolder());
  static const bool made = [] {
    for (const char* film : {"a.mp4", "b.mp4"}) std::ofstream(scratch.path() / film);
    return true;
  }();
  (void)made;
  return scratch.path();
}

void CheckArray(const NpyArray& array) {
  size_t count = 1;
  for (const size_t side : array.shape) count *= side;
  if (array.values.size() != count || count > kMaxValues) std::abort();
  for (const double value : array.values) {
    if (!std::isfinite(value)) std::abort();
  }
}

void CheckFilm(const CameraFilm& film) {
  const Camera& camera = film.view.captured_camera;
  if (!film.view.cam_from_world.Center().allFinite()) std::abort();
  if (!(camera.width > 0 && camera.height > 0 && camera.fx > 0.0)) std::abort();
}

}  // namespace

std::vector<std::string> FuzzSeeds() {
  // Down, right, backwards, position, size and focal length.
  std::vector<double> row = {0, 1, 0, 0.5, 64, -1, 0, 0, 0.25, 96, 0, 0, 1, 4, 60, 1, 9};
  std::vector<double> rows = row;
  rows.insert(rows.end(), row.begin(), row.end());
  const std::string good = NpyOf({2, 17}, rows);
  std::string fortran = good;
  fortran.replace(fortran.find("False, "), 7, "True,  ");
  std::string floats = NpyOf({3, 2}, {1, 2, 3});
  floats.replace(floats.find("<f8"), 3, "<f4");
  std::string whole = NpyOf({2, 3}, {1, 2, 3, 4, 5, 6});
  whole.replace(whole.find("<f8"), 3, "<i8");
  rows[3] = std::numeric_limits<double>::max();
  rows[8] = rows[13] = rows[3];
  return {good, NpyOf({2, 17}, rows), fortran, floats, whole, NpyOf({0, 17}, {})};
}

}  // namespace color3d

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace color3d;
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  bool is_array = false;
  ReadOrRefuse([&] {
    CheckArray(ReadNpy(bytes, "points.npy", kMaxValues));
    is_array = true;
  });
  if (!is_array) return 0;
  std::ofstream(FolderOfFilms() / kPosesBounds, std::ios::binary) << bytes;
  return ReadOrRefuse([&] {
    const std::vector<CameraFilm> films = ReadPosesBounds(FolderOfFilms());
    if (films.size() != 2) std::abort();
    for (const CameraFilm& film : films) CheckFilm(film);
  });
}
