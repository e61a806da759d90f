#include "core/catalogue/memory_model.h"

#include <algorithm>
#include <iterator>

#include "core/catalogue/kind_row.h"
#include "core/catalogue/stages.h"

namespace color3d {
namespace {

constexpr int64_t kMiB = int64_t{1} << 20;

// Geometry.
constexpr int64_t kProgramBytes = 96 * kMiB;  // code, libraries, scene, stacks
constexpr int64_t kBytesPerPair = 42;
constexpr int64_t kPairsPerGaussian = 8;
constexpr int64_t kPairsPerTile = 400;
constexpr int64_t kTilePx = 256;
// Of a channel: pictures, gradients and filtered moments of the loss.
constexpr int64_t kWorkBytesPerPixel = 80;
constexpr int64_t kPhotoBytesPerPixel = 36;  // decoded (3 x 16 bit), as float, turned, undistorted
constexpr int64_t kTargetCacheBytes = 512 * kMiB;
constexpr int64_t kFrameTargetCacheBytes = 128 * kMiB;  // of dynamic scenes
constexpr int64_t kSurveyBytes = 80 * kMiB;             // of the motion survey

constexpr int64_t kIdleWorkerBytes = 170 * kMiB;

// Memory above that of an idle worker. Measured with the preset fast on fern, banana and fox.
struct StageMemory {
  const char* stage;
  int64_t fixed_mib;
  int bytes_per_pixel;  // of all views
};

constexpr StageMemory kStageMemory[] = {{kind::kImportScene, 10, 0},
                                        {kind::kSelectKeyView, 130, 0},
                                        {kind::kColorizeKeyView, 60, 0},
                                        {kind::kCarryColor, 100, 10},
                                        {kind::kPersonalize, 400, 0},
                                        {kind::kColorizeViews, 330, 0},
                                        {kind::kSolveChroma, 100, 167},
                                        {kind::kExport, 200, 0},
                                        {kind::kRender, 150, 0},
                                        {kind::kEvaluate, 180, 0}};
constexpr StageMemory kOtherStage = {nullptr, 180, 0};  // not measured, or the report

// The chroma solver keeps its weights within these budgets (core/splat/chroma/chroma_options.h).
struct KindMemory {
  CaptureKind kind;
  bool moves;  // as in GeometryMemory
  int64_t most_weight_bytes;
};

constexpr KindMemory kKindMemory[] = {{CaptureKind::kStatic, false, 2560 * kMiB},
                                      {CaptureKind::kFilm, true, 480 * kMiB},
                                      {CaptureKind::kDynamic, true, 480 * kMiB},
                                      {CaptureKind::kRelief, true, 480 * kMiB},
                                      {CaptureKind::kPictures, false, 2560 * kMiB}};

const KindMemory& MemoryOf(CaptureKind kind) { return RowOfKind(kKindMemory, kind, "memory"); }

int64_t GeometryBytes(const StageWork& work) {
  const auto pixels = static_cast<int64_t>(1e6 * work.megapixels);
  return GeometryBytes(GeometryMemory{.largest_photo_px = pixels,
                                      .largest_picture_px = pixels,
                                      .all_pictures_px = work.views * pixels,
                                      .gaussians = work.gaussians,
                                      .sh_degree = work.sh_degree,
                                      .channels = work.trains_jointly ? 3 : 1,
                                      .moves = MemoryOf(work.kind).moves});
}

}  // namespace

int64_t TargetCacheBytes(bool moves) { return moves ? kFrameTargetCacheBytes : kTargetCacheBytes; }

int64_t PhotoBytes(int64_t pixels) { return kPhotoBytesPerPixel * pixels; }

int64_t BytesPerGaussian(int sh_degree, int channels) {
  const int64_t harmonics = int64_t{sh_degree + 1} * (sh_degree + 1);
  return 4 * (11 * (11 + channels * harmonics) + 32);
}

int64_t BytesPerGaussianWithPairs(int sh_degree, int channels) {
  return BytesPerGaussian(sh_degree, channels) + kBytesPerPair * kPairsPerGaussian;
}

int64_t GeometryBytes(const GeometryMemory& m) {
  // The trainer keeps pictures at two sizes (4 + 1 bytes a pixel) within its own budget.
  return kProgramBytes + PhotoBytes(m.largest_photo_px) +
         m.channels * kWorkBytesPerPixel * m.largest_picture_px +
         std::min(TargetCacheBytes(m.moves), (4 * m.channels + 1) * m.all_pictures_px) +
         (m.moves ? kSurveyBytes : 0) + m.deformation_bytes +
         kBytesPerPair * kPairsPerTile * (m.largest_picture_px / kTilePx + 1) +
         m.gaussians * BytesPerGaussianWithPairs(m.sh_degree, m.channels);
}

int64_t EstimatePeakBytes(std::string_view stage, const StageWork& work) {
  StageOf(stage);  // throws if it is unknown
  if ((stage == kind::kReconstructGeometry && !work.geometry_given) ||
      (stage == kind::kSolveChroma && work.trains_jointly)) {
    return kIdleWorkerBytes + GeometryBytes(work);
  }
  const auto* found =
      std::ranges::find_if(kStageMemory, [&](const StageMemory& m) { return stage == m.stage; });
  const StageMemory& memory = found == std::end(kStageMemory) ? kOtherStage : *found;
  const auto of_pixels =
      static_cast<int64_t>(1e6 * work.views * work.megapixels * memory.bytes_per_pixel);
  return kIdleWorkerBytes + memory.fixed_mib * kMiB +
         std::min(of_pixels, MemoryOf(work.kind).most_weight_bytes);
}

}  // namespace color3d
