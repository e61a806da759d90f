// Fuzz target: the readers of splats.
#include <string_view>

#include "core/splat/export/sog/sog.h"
#include "core/splat/export/spz/spz.h"
#include "core/splat/import/splat_file.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/support/scenes/splat_files.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  return color3d::ReadOrRefuse([&] {
    color3d::SplatSource source;
    source.max_gaussians = 100'000;
    color3d::ViewerGaussians g;
    try {
      g = color3d::ReadSplat({reinterpret_cast<const char*>(data), size}, source);
    } catch (const color3d::Error& error) {
      if (error.code() != color3d::ErrorCode::kResourceExhausted) throw;
      return;
    }
    const size_t rows = 3 * color3d::ShCoefficients(g.sh_degree);
    if (g.size() > 100'000 || g.position.size() != 3 * g.size() ||
        g.log_scale.size() != 3 * g.size() || g.rotation.size() != 4 * g.size() ||
        g.sh.size() != rows * g.size()) {
      std::abort();
    }
  });
}

namespace color3d {

std::vector<std::string> FuzzSeeds() {
  ThreadPool pool(1);
  const ViewerGaussians plain = BallOnGround(12), rich = BallOnGround(12, 0.2f, 2);
  return {SplatPly(plain),
          SplatPly(rich),
          EncodeSog(plain, pool),
          EncodeSog(rich, pool),
          EncodeSpz(plain, SpzVersion::k2, pool),
          EncodeSpz(rich, SpzVersion::k2, pool),
          EncodeSpz(plain, SpzVersion::k4, pool),
          EncodeSpz(rich, SpzVersion::k4, pool)};
}

}  // namespace color3d
