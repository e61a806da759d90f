#include "core/colorizer/personal_corrector.h"

#include <torch/types.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/colorizer/known_cells.h"
#include "core/colorizer/padding.h"
#include "core/encoder/image_tensors.h"
#include "core/encoder/torch_errors.h"
#include "core/encoder/torch_threads.h"
#include "core/image/codec.h"
#include "core/image/guided_upsample.h"
#include "core/image/weighted_resize.h"

namespace color3d {
namespace {

constexpr uint64_t kSeed = 1;
constexpr double kCovered = 0.25;  // share of a cell that the user coloured, to count

TrainingPicture AtSide(const TrainingPicture& picture, int max_side_px) {
  TrainingPicture small = picture;
  small.luminance = FitWithin(picture.luminance, max_side_px);
  const int width = small.luminance.width, height = small.luminance.height;
  small.ab = ResizeWeighted(picture.ab, picture.weight, width, height);
  small.weight = Resize(picture.weight, width, height);
  if (!picture.position.Empty()) small.position = Resize(picture.position, width, height);
  return small;
}

CellBank Rows(const CellBank& bank, const torch::Tensor& rows) {
  return {bank.features.index_select(0, rows),
          bank.colors.index_select(0, rows),
          bank.weights.index_select(0, rows),
          bank.positions.index_select(0, rows)};
}

}  // namespace

PersonalCorrector::PersonalCorrector(std::shared_ptr<const TapEncoder> encoder,
                                     const FeatureNeighbors& learnt,
                                     RelativeChroma relative_chroma,
                                     int max_side_px,
                                     int threads,
                                     std::span<const TrainingPicture> corrected,
                                     const CorrectionOptions& options)
    : encoder_(std::move(encoder)),
      whitening_(learnt.whitening()),
      relative_chroma_(relative_chroma),
      max_side_px_(max_side_px),
      threads_(threads),
      options_(options) {
  torch::NoGradGuard no_grad;
  std::vector<KnownCells> parts;
  for (const TrainingPicture& picture : corrected) {
    const KnownCells cells = CellsOf(*encoder_, AtSide(picture, max_side_px_), relative_chroma_);
    const torch::Tensor covered = (cells.weights > kCovered).nonzero().squeeze(1);
    if (covered.size(0) > 0) parts.push_back(Select(cells, covered));
  }
  if (parts.empty()) throw InvalidArgument("the corrections cover nothing");
  const KnownCells all = Join(parts);
  corrected_ = {whitening_.Apply(all.blocks), all.colors, all.weights, all.positions};
  Random random(kSeed);
  CellBank rivals = Rows(
      learnt.bank(), SampleRows(learnt.bank().features.size(0), options_.rivals, random));
  VoteOptions nearest = options_.vote;
  nearest.median_steps = 0;
  const torch::Tensor apart =
      MatchCells({rivals.features, rivals.positions}, corrected_, nearest).apart;
  rivals.weights = rivals.weights * (1.0 - (-apart / options_.reach).exp());
  const auto marks = [](const CellBank& bank, double mark) {
    torch::Tensor colors = torch::zeros({bank.features.size(0), 2});
    colors.select(1, 0).fill_(mark);
    return colors;
  };
  rivals_and_corrected_ = {torch::cat({rivals.features, corrected_.features}),
                           torch::cat({marks(rivals, 0.0), marks(corrected_, 1.0)}),
                           torch::cat({rivals.weights, corrected_.weights}),
                           torch::cat({rivals.positions, corrected_.positions})};
}

CorrectedColor PersonalCorrector::Predict(const Image& luminance, const PictureFacts& facts) const {
  return WithTorchErrors("correction", [&] {
    torch::NoGradGuard no_grad;
    SetTorchThreads(threads_);
    const Image small = FitWithin(luminance, max_side_px_);
    const torch::Tensor padded = PaddedTensor(small);
    const CellFeatures cells =
        DescribeCells(encoder_->config(), encoder_->Taps(encoder_->Input(padded)), padded);
    const CellQueries queries{
        whitening_.Apply(cells.blocks),
        PlacesOf(facts.position.Empty() ? Image()
                                        : Resize(facts.position, small.width, small.height),
                 cells.Count())};
    VoteOptions share = options_.vote;
    share.median_steps = 0;
    const torch::Tensor found =
        torch::cat({MatchCells(queries, corrected_, options_.vote).ab,
                    MatchCells(queries, rivals_and_corrected_, share).ab.slice(1, 0, 1)},
                   1);
    const Image coarse = ImageFromTensor(found.t().reshape({3, cells.rows, cells.columns}));
    Image fine = UpsampleGuided(coarse, ImageFromTensor(padded));
    fine = CropTo(fine, small.width, small.height);
    if (small.width != luminance.width || small.height != luminance.height) {
      fine = UpsampleGuided(fine, luminance);
    }
    CorrectedColor color{Image(luminance.width, luminance.height, 2),
                         Image(luminance.width, luminance.height, 1)};
    for (int c = 0; c < 2; ++c) {
      std::copy_n(fine.Plane(c), fine.PlaneSize(), color.ab.Plane(c));
    }
    std::transform(fine.Plane(2), fine.Plane(2) + fine.PlaneSize(), color.share.Plane(0),
                   [](float value) { return std::clamp(value, 0.0f, 1.0f); });
    color.ab = FromRelative(relative_chroma_, luminance, std::move(color.ab));
    return color;
  });
}

}  // namespace color3d
