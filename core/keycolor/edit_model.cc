#include "core/keycolor/edit_model.h"

#include <algorithm>
#include <cmath>

namespace color3d {
namespace {

// Bins of L, a and b; the grid is blurred by (1 2 1) / 4 along each axis, and read linearly.
constexpr float kBinL = 12.5f, kBinAb = 4.0f;
constexpr float kMaxAb = 112.0f;
constexpr int kBinsL = 9, kBinsAb = 57;
constexpr int kStrideA = kBinsAb, kStrideL = kBinsAb * kBinsAb;
// Pixels of the mean change that each bin has in addition to its own.
constexpr float kPriorPixels = 2.0f;
// Probability of a bin that is added in both parts.
constexpr float kFloor = 1e-4f;

struct Axis {
  int low;
  float share;  // of the bin above `low`
};

Axis Place(float value, float least, float bin, int bins) {
  const float at = std::clamp((value - least) / bin, 0.0f, static_cast<float>(bins - 1) - 1e-3f);
  const int low = static_cast<int>(at);
  return {low, at - static_cast<float>(low)};
}

// Calls `visit(index, weight)` for the eight bins around a colour.
template <class Visit>
void ForBinsAround(float l, float a, float b, const Visit& visit) {
  const Axis axes[3] = {Place(l, 0.0f, kBinL, kBinsL),
                        Place(a, -kMaxAb, kBinAb, kBinsAb),
                        Place(b, -kMaxAb, kBinAb, kBinsAb)};
  for (int corner = 0; corner < 8; ++corner) {
    const int up[3] = {corner >> 2, (corner >> 1) & 1, corner & 1};
    float weight = 1.0f;
    for (int i = 0; i < 3; ++i) weight *= up[i] == 1 ? axes[i].share : 1.0f - axes[i].share;
    visit((axes[0].low + up[0]) * kStrideL + (axes[1].low + up[1]) * kStrideA + axes[2].low + up[2],
          weight);
  }
}

}  // namespace

void EditModel::Sums::Add(const Sums& other, float weight) {
  inside += weight * other.inside;
  outside += weight * other.outside;
  for (int c = 0; c < 2; ++c) change[c] += weight * other.change[c];
  squares += weight * other.squares;
}

EditModel::EditModel(std::span<const EditedPicture> pictures)
    : bins_(static_cast<size_t>(kBinsL) * kStrideL) {
  for (const EditedPicture& picture : pictures) {
    const Image& lab = picture.lab;
    for (size_t i = 0; i < lab.PlaneSize(); ++i) {
      const float share = picture.edited.data[i];
      const float da = picture.ab.Plane(0)[i] - lab.Plane(1)[i];
      const float db = picture.ab.Plane(1)[i] - lab.Plane(2)[i];
      const Sums pixel{share, 1.0f - share, {share * da, share * db}, share * (da * da + db * db)};
      ForBinsAround(lab.Plane(0)[i], lab.Plane(1)[i], lab.Plane(2)[i], [&](int bin, float weight) {
        bins_[bin].Add(pixel, weight);
      });
      total_.Add(pixel, 1.0f);
    }
  }
  Blur(kStrideL, kBinsL);
  Blur(kStrideA, kBinsAb);
  Blur(1, kBinsAb);
}

// Along the axis with this stride and number of bins.
void EditModel::Blur(int stride, int size) {
  const std::vector<Sums> before = bins_;
  for (int i = 0; i < static_cast<int>(bins_.size()); ++i) {
    const int place = i / stride % size;
    Sums sum;
    sum.Add(before[i], 0.5f);
    sum.Add(before[place > 0 ? i - stride : i], 0.25f);
    sum.Add(before[place + 1 < size ? i + stride : i], 0.25f);
    bins_[i] = sum;
  }
}

EditModel::Answer EditModel::At(float l, float a, float b) const {
  Answer answer;
  if (!(total_.inside > 0.0f)) return answer;
  Sums sums;
  ForBinsAround(l, a, b, [&](int bin, float weight) { sums.Add(bins_[bin], weight); });
  const float count = sums.inside + kPriorPixels;
  const float prior = kPriorPixels / total_.inside;
  float squared_mean = 0.0f;
  for (int c = 0; c < 2; ++c) {
    answer.change[c] = (sums.change[c] + prior * total_.change[c]) / count;
    squared_mean += answer.change[c] * answer.change[c];
  }
  answer.variance = std::max(0.0f, (sums.squares + prior * total_.squares) / count - squared_mean);
  if (total_.outside > 0.0f) {
    answer.likelihood_ratio =
        (sums.inside / total_.inside + kFloor) / (sums.outside / total_.outside + kFloor);
  }
  return answer;
}

float EditModel::EditedShareOfAll() const {
  const float all = total_.inside + total_.outside;
  return all > 0.0f ? total_.inside / all : 0.0f;
}

}  // namespace color3d
