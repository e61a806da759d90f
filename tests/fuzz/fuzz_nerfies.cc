// Fuzz target: JSON and points of scenes of Nerfies and HyperNeRF. An input consists of the files
// metadata.json, camera/a.json, camera/b.json and points.npy, separated by kBetween.
#include <array>
#include <cmath>
#include <fstream>
#include <string_view>

#include "core/base/files.h"
#include "core/image/codec.h"
#include "core/scene/formats/nerfies.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/support/formats/npy_writer.h"
#include "tests/support/memory_folder.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;

constexpr char kBetween = '\x1e';
constexpr std::array<const char*, 4> kFiles = {
    "metadata.json", "camera/a.json", "camera/b.json", "points.npy"};

// With the pictures of two frames.
class SceneFolder {
 public:
  SceneFolder() {
    for (const char* folder : {"camera", "rgb/2x"}) fs::create_directories(path() / folder);
    for (const char* frame : {"a", "b"}) {
      WriteFileAtomic(path() / "rgb/2x" / (std::string(frame) + ".png"),
                      EncodePng8(Image(8, 6, 3)));
    }
  }
  const fs::path& path() const { return scratch_.path(); }
  // Files missing at the end do not exist.
  void Write(std::string_view input) const {
    for (const char* file : kFiles) {
      const size_t end = input.find(kBetween);
      if (input.empty() && file != kFiles.front()) {
        fs::remove(path() / file);
      } else {
        std::ofstream(path() / file, std::ios::binary) << input.substr(0, end);
      }
      input.remove_prefix(end == std::string_view::npos ? input.size() : end + 1);
    }
  }

 private:
  const ScratchFolder scratch_{MemoryFolder()};
};

void CheckScene(const Scene& scene) {
  if (scene.views.size() != 2) std::abort();
  for (const View& view : scene.views) {
    const Camera& camera = view.camera;
    if (!view.cam_from_world.Center().allFinite()) std::abort();
    if (camera.width != 8 || camera.height != 6 || !(camera.fx > 0.0 && camera.fy > 0.0)) {
      std::abort();
    }
    if (view.moment && !std::isfinite(view.moment->time_s)) std::abort();
  }
  for (const SparsePoint& point : scene.points) {
    if (!point.position.allFinite()) std::abort();
  }
}

std::string Joined(const std::vector<std::string>& files) {
  std::string input;
  for (const std::string& file : files)
    input += (input.empty() ? "" : std::string(1, kBetween)) + file;
  return input;
}

}  // namespace

std::vector<std::string> FuzzSeeds() {
  const auto camera = [](const char* position, const char* more) {
    return std::string(R"({"orientation":[[1,0,0],[0,1,0],[0,0,1]],"position":)") + position +
           R"(,"focal_length":10,"principal_point":[8,6],"image_size":[16,12])" + more + "}";
  };
  const std::string a = camera("[0.5,0,-2]", "");
  const std::string b =
      camera("[-0.5,0,-2]",
             R"(,"skew":0.0,"pixel_aspect_ratio":1.02,"radial_distortion":[0.01,0.002,0.003],)"
             R"("tangential_distortion":[0.001,0])");
  const std::string frames = R"({"a":{"time_id":0,"camera_id":1},"b":{"time_id":3,"camera_id":1}})";
  return {Joined({frames, a, b, NpyOf({2, 3}, {0, 0, 1, 0.1, 0.2, 2})}),
          Joined({R"({"a":{"warp_id":1},"b":{"warp_id":1,"camera_id":1},"c":{}})", a, b}),
          Joined({frames, camera("[1e308,1e308,1e308]", ""), b}),
          Joined({R"({"a":{},"../b":{}})", a, b}),
          Joined({frames, "[]", b})};
}

}  // namespace color3d

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace color3d;
  static const SceneFolder folder;
  folder.Write({reinterpret_cast<const char*>(data), size});
  return ReadOrRefuse([] { CheckScene(ReadNerfies(folder.path())); });
}
