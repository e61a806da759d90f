// Feature planes, network and heads against a float64 reference, once per instruction set.
#include "core/splat/hexplane/hexplane.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/base/random.h"
#include "tests/support/instruction_set_testing.h"

namespace color3d {
namespace {

constexpr int64_t kCount = 70;  // more than a chunk
constexpr int kRows = kColorRow + 1;
constexpr int kOffsetRows[kOffsets] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};

HexPlaneShape SmallShape() {
  HexPlaneShape shape;
  shape.begin_s = 1.0;
  shape.end_s = 3.0;
  shape.low = {-2.0f, -1.5f, -1.0f};
  shape.high = {2.0f, 1.0f, 3.0f};
  shape.extent = 1.7f;
  shape.width = 16;
  shape.levels = {{3, 4}, {5, 3}};
  return shape;
}

// All in float64.
struct Reference {
  HexPlaneShape shape;
  std::vector<double> planes, network;

  double Feature(int level, int plane, int f, const std::array<double, 4>& u) const {
    const int a = kHexPlaneAxes[plane][0], b = kHexPlaneAxes[plane][1];
    const int na = shape.Samples(level, a), nb = shape.Samples(level, b);
    double sum = 0.0;
    for (int j = 0; j < nb; ++j) {
      for (int i = 0; i < na; ++i) {
        const double wa = std::max(0.0, 1.0 - std::abs((u[a] + 1.0) / 2.0 * (na - 1) - i));
        const double wb = std::max(0.0, 1.0 - std::abs((u[b] + 1.0) / 2.0 * (nb - 1) - j));
        sum += wa * wb *
               planes[shape.PlaneBegin(level, plane) +
                      static_cast<size_t>((j * na + i) * shape.features + f)];
      }
    }
    return sum;
  }

  std::vector<double> Layer(int layer, const std::vector<double>& x, bool rectify) const {
    std::vector<double> y;
    for (int o = 0; o < shape.LayerOutputs(layer); ++o) {
      double sum = network[shape.BiasBegin(layer) + o];
      for (int k = 0; k < shape.LayerInputs(layer); ++k) {
        sum += x[k] * network[shape.WeightsBegin(layer) + k * shape.LayerOutputs(layer) + o];
      }
      y.push_back(rectify ? std::max(0.0, sum) : sum);
    }
    return y;
  }

  // Ten parameters of one Gaussian at time t.
  std::vector<double> At(const std::vector<double>& canonical, double t) const {
    std::array<double, 4> u;
    for (int k = 0; k < 3; ++k) {
      const double low = shape.low[k], high = shape.high[k];
      u[k] = std::clamp(2.0 * (canonical[k] - low) / (high - low) - 1.0, -1.0, 1.0);
    }
    u[3] = t;
    std::vector<double> features;
    for (int level = 0; level < static_cast<int>(shape.levels.size()); ++level) {
      for (int f = 0; f < shape.features; ++f) {
        double product = 1.0;
        for (int p = 0; p < kHexPlanes; ++p) product *= Feature(level, p, f, u);
        features.push_back(product);
      }
    }
    const std::vector<double> offsets = Layer(2, Layer(1, Layer(0, features, true), true), false);
    std::vector<double> at = canonical;
    for (int k = 0; k < kOffsets; ++k) at[k] += (k < 3 ? shape.extent : 1.0) * offsets[k];
    return at;
  }
};

class HexPlaneTest : public InstructionSetTest<int> {  // of thread counts
 protected:
  HexPlaneTest() {
    Random random(4);
    const auto fill = [&](size_t count, double low, double high) {
      std::vector<double> values;
      for (size_t i = 0; i < count; ++i) {
        values.push_back(static_cast<float>(random.NextUniform(low, high)));
      }
      return values;
    };
    truth_.shape = SmallShape();
    truth_.planes = fill(truth_.shape.PlaneFloats(), 0.5, 1.5);
    truth_.network = fill(truth_.shape.NetworkFloats(), -0.5, 0.5);
    // Each head reads its own part.
    const int width = truth_.shape.width;
    for (int k = 0; k < 3 * width; ++k) {
      for (int o = 0; o < kOffsetStride; ++o) {
        const int head = k / width;
        if (o >= kFirstOffsetOfHead[head] && o < kFirstOffsetOfHead[head + 1]) continue;
        truth_.network[truth_.shape.WeightsBegin(2) + k * kOffsetStride + o] = 0.0;
      }
    }
    planes_.assign(truth_.planes.begin(), truth_.planes.end());
    network_.assign(truth_.network.begin(), truth_.network.end());
    for (int r = 0; r < kRows; ++r) {
      for (int64_t i = 0; i < kCount; ++i) {
        canonical_.Row(r)[i] = static_cast<float>(random.NextNormal());
        d_at_.Row(r)[i] = static_cast<float>(random.NextNormal());
      }
    }
  }

  std::vector<double> Canonical(int64_t i) const {
    std::vector<double> p;
    for (const int row : kOffsetRows) p.push_back(canonical_.Row(row)[i]);
    return p;
  }

  HexPlaneAt Deformation(float t) const {
    return {truth_.shape, planes_.data(), network_.data(), t};
  }

  // dL/d(at) times the Gaussians of `reference` at t.
  double Loss(const Reference& reference, double t) const {
    double loss = 0.0;
    for (int64_t i = 0; i < kCount; ++i) {
      const std::vector<double> at = reference.At(Canonical(i), t);
      for (int k = 0; k < kOffsets; ++k) loss += d_at_.Row(kOffsetRows[k])[i] * at[k];
    }
    return loss;
  }

  // Every 61st number, by central differences.
  void ExpectGradient(std::vector<double> Reference::*numbers,
                      const std::vector<float>& gradient,
                      double t) {
    constexpr double kStep = 1e-6;
    for (size_t i = 0; i < gradient.size(); i += 61) {
      // A head's weights on another head's part, and those of unused columns, are fixed.
      if ((truth_.*numbers)[i] == 0.0) {
        EXPECT_EQ(gradient[i], 0.0f);
        continue;
      }
      Reference up = truth_, down = truth_;
      (up.*numbers)[i] += kStep;
      (down.*numbers)[i] -= kStep;
      const double expected = (Loss(up, t) - Loss(down, t)) / (2.0 * kStep);
      EXPECT_NEAR(gradient[i], expected, 2e-4 * (1.0 + std::abs(expected))) << i;
    }
  }

  ThreadPool pool_{TestCase()};
  Reference truth_;
  std::vector<float> planes_, network_;
  ParameterBlock canonical_{kRows, kCount}, d_at_{kRows, kCount};
};

TEST_P(HexPlaneTest, AgreesWithFloat64Reference) {
  for (const float t : {-1.0f, -0.3f, 0.4f, 1.0f}) {
    ParameterBlock at = canonical_;
    ApplyHexPlanes(Deformation(t), pool_, at);
    for (int64_t i = 0; i < kCount; ++i) {
      const std::vector<double> expected = truth_.At(Canonical(i), t);
      for (int k = 0; k < kOffsets; ++k) {
        EXPECT_NEAR(at.Row(kOffsetRows[k])[i], expected[k], 1e-4 * (1.0 + std::abs(expected[k])));
      }
      EXPECT_EQ(at.Row(kOpacityRow)[i], canonical_.Row(kOpacityRow)[i]);
      EXPECT_EQ(at.Row(kColorRow)[i], canonical_.Row(kColorRow)[i]);
    }
  }
}

TEST_P(HexPlaneTest, GradientAgreesWithFloat64Reference) {
  constexpr float kTime = 0.37f;
  ParameterBlock gradient = d_at_;
  HexPlaneWorkspace workspace;
  std::vector<float> d_planes(planes_.size()), d_network(network_.size());
  ApplyHexPlanesBackward(Deformation(kTime),
                         canonical_,
                         pool_,
                         workspace,
                         gradient,
                         d_planes.data(),
                         d_network.data());
  for (int64_t i = 0; i < kCount; ++i) {
    const std::vector<double> canonical = Canonical(i);
    for (int k = 0; k < kOffsets; ++k) {
      constexpr double kStep = 1e-6;
      std::vector<double> up = canonical, down = canonical;
      up[k] += kStep;
      down[k] -= kStep;
      const std::vector<double> at_up = truth_.At(up, kTime), at_down = truth_.At(down, kTime);
      double expected = 0.0;
      for (int j = 0; j < kOffsets; ++j) {
        expected += d_at_.Row(kOffsetRows[j])[i] * (at_up[j] - at_down[j]) / (2.0 * kStep);
      }
      EXPECT_NEAR(gradient.Row(kOffsetRows[k])[i], expected, 2e-4 * (1.0 + std::abs(expected)))
          << "row " << k << " of Gaussian " << i;
    }
    EXPECT_EQ(gradient.Row(kOpacityRow)[i], d_at_.Row(kOpacityRow)[i]);
  }
  ExpectGradient(&Reference::planes, d_planes, kTime);
  ExpectGradient(&Reference::network, d_network, kTime);
}

TEST(HexPlaneShapeTest, ClampsTimesOutsideRange) {
  const HexPlaneShape shape = SmallShape();
  EXPECT_EQ(shape.UnitTime(1.0), -1.0f);
  EXPECT_EQ(shape.UnitTime(2.0), 0.0f);
  EXPECT_EQ(shape.UnitTime(3.0), 1.0f);
  EXPECT_EQ(shape.UnitTime(-100.0), -1.0f);
  EXPECT_EQ(shape.UnitTime(100.0), 1.0f);
}

INSTANTIATE_TEST_SUITE_P(Threads,
                         HexPlaneTest,
                         testing::Combine(testing::Values(1, 3), EachInstructionSet()));

}  // namespace
}  // namespace color3d
