#include "tests/support/networks/random_features.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "core/base/random.h"

namespace color3d {
namespace {

constexpr double kPi = std::numbers::pi;

WeightArray Filled(std::vector<int64_t> shape, float value) {
  int64_t count = 1;
  for (int64_t size : shape) count *= size;
  return {std::move(shape), std::vector<float>(static_cast<size_t>(count), value)};
}

// Rows of unit length; orthogonal in groups of `columns` (Gram-Schmidt).
std::vector<double> OrthogonalRows(int rows, int columns, Random& random) {
  std::vector<double> matrix(static_cast<size_t>(rows) * columns);
  for (int row = 0; row < rows; ++row) {
    double* current = &matrix[static_cast<size_t>(row) * columns];
    for (int i = 0; i < columns; ++i) current[i] = random.NextNormal();
    for (int other = row - row % columns; other < row; ++other) {
      const double* previous = &matrix[static_cast<size_t>(other) * columns];
      double dot = 0.0;
      for (int i = 0; i < columns; ++i) dot += current[i] * previous[i];
      for (int i = 0; i < columns; ++i) current[i] -= dot * previous[i];
    }
    double norm = 0.0;
    for (int i = 0; i < columns; ++i) norm += current[i] * current[i];
    norm = std::sqrt(std::max(norm, 1e-12));
    for (int i = 0; i < columns; ++i) current[i] /= norm;
  }
  return matrix;
}

std::vector<double> Gaussian(int size, double sigma) {
  std::vector<double> filter(static_cast<size_t>(size) * size);
  const double center = 0.5 * (size - 1);
  double sum = 0.0;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const double r2 = (x - center) * (x - center) + (y - center) * (y - center);
      sum += filter[y * size + x] = std::exp(-r2 / (2.0 * sigma * sigma));
    }
  }
  for (double& value : filter) value /= sum;
  return filter;
}

// Zero mean and the given sum of magnitudes.
void NormaliseBandPass(std::vector<double>& filter, double magnitude) {
  double mean = 0.0;
  for (double value : filter) mean += value;
  mean /= static_cast<double>(filter.size());
  double sum = 0.0;
  for (double& value : filter) sum += std::abs(value -= mean);
  for (double& value : filter) value *= magnitude / std::max(sum, 1e-12);
}

std::vector<double> Gabor(int size, double wavelength, double angle, double phase) {
  std::vector<double> filter = Gaussian(size, 0.45 * wavelength);
  const double center = 0.5 * (size - 1);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const double along = (x - center) * std::cos(angle) + (y - center) * std::sin(angle);
      filter[y * size + x] *= std::cos(2.0 * kPi * along / wavelength + phase);
    }
  }
  return filter;
}

// Filter `index` of the stem: low-passes, differences of Gaussians, then Gabor pairs.
std::vector<double> StemFilter(int index, int size, Random& random) {
  constexpr int kLowPasses = 4;
  constexpr int kDogs = 4;
  if (index < kLowPasses) return Gaussian(size, 0.7 + 0.6 * index);
  std::vector<double> filter;
  if (index < kLowPasses + kDogs) {
    const double sigma = 0.5 * std::pow(1.5, index - kLowPasses);
    filter = Gaussian(size, sigma);
    const std::vector<double> wide = Gaussian(size, 1.6 * sigma);
    for (size_t i = 0; i < filter.size(); ++i) filter[i] -= wide[i];
  } else {
    const int gabor = index - kLowPasses - kDogs;
    const double wavelength = (gabor / 8) % 3 == 0 ? 3.0 : (gabor / 8) % 3 == 1 ? 5.5 : 8.0;
    const double angle = kPi / 4.0 * (gabor % 4) + (gabor >= 24 ? random.NextUniform(0, kPi) : 0.0);
    filter = Gabor(size, wavelength, angle, gabor % 8 < 4 ? 0.0 : 0.5 * kPi);
  }
  NormaliseBandPass(filter, 4.0);
  return filter;
}

void AddStem(const ConvNextConfig& config, Random& random, WeightMap& weights) {
  const int k = config.stem_kernel;
  const int dims = config.dims[0];
  WeightArray weight = Filled({dims, 3, k, k}, 0.0f);
  WeightArray bias = Filled({dims}, 0.0f);
  for (int c = 0; c < dims; ++c) {
    const std::vector<double> filter = StemFilter(c, k, random);
    for (int channel = 0; channel < 3; ++channel) {
      for (size_t i = 0; i < filter.size(); ++i) {
        weight.values[(static_cast<size_t>(c) * 3 + channel) * k * k + i] =
            static_cast<float>(filter[i] / 3.0);
      }
    }
    // The constant part keeps the layer norm from blowing up the noise of flat regions.
    bias.values[c] = static_cast<float>(c < 4 ? (c % 2 == 0 ? 0.6 : -0.6) : 0.0);
  }
  weights["downsample_layers.0.0.weight"] = std::move(weight);
  weights["downsample_layers.0.0.bias"] = std::move(bias);
  weights["downsample_layers.0.1.weight"] = Filled({dims}, 1.0f);
  weights["downsample_layers.0.1.bias"] = Filled({dims}, 0.0f);
}

// 2x2 stride 2: a channel mixture, averaged over the four pixels with a little random detail.
void AddDownsampling(int stage, const ConvNextConfig& config, Random& random, WeightMap& weights) {
  const int in = config.dims[stage - 1];
  const int out = config.dims[stage];
  const std::string prefix = fmt::format("downsample_layers.{}.", stage);
  const std::vector<double> mix = OrthogonalRows(out, in, random);
  WeightArray weight = Filled({out, in, 2, 2}, 0.0f);
  for (size_t i = 0; i < mix.size(); ++i) {
    for (int tap = 0; tap < 4; ++tap) {
      weight.values[i * 4 + tap] =
          static_cast<float>(mix[i] * (0.25 + 0.1 * random.NextUniform(-1.0, 1.0)));
    }
  }
  weights[prefix + "0.weight"] = Filled({in}, 1.0f);
  weights[prefix + "0.bias"] = Filled({in}, 0.0f);
  weights[prefix + "1.weight"] = std::move(weight);
  weights[prefix + "1.bias"] = Filled({out}, 0.0f);
}

// Half of the depth-wise filters are low-passes (they pool what the last block rectified), half
// random band-passes under a Gaussian window.
WeightArray DepthwiseFilters(int channels, Random& random) {
  constexpr int kSize = 7;
  WeightArray weight = Filled({channels, 1, kSize, kSize}, 0.0f);
  for (int c = 0; c < channels; ++c) {
    std::vector<double> filter = Gaussian(kSize, c % 2 == 0 ? random.NextUniform(0.8, 2.5) : 1.5);
    if (c % 2 == 1) {
      const std::vector<double> gabor = Gabor(kSize,
                                              random.NextUniform(4.0, 10.0),
                                              random.NextUniform(0, kPi),
                                              random.NextUniform(0, 2 * kPi));
      filter = gabor;
      NormaliseBandPass(filter, 2.0);
    }
    for (size_t i = 0; i < filter.size(); ++i) {
      weight.values[static_cast<size_t>(c) * kSize * kSize + i] = static_cast<float>(filter[i]);
    }
  }
  return weight;
}

WeightArray Scaled(const std::vector<double>& matrix, int rows, int columns, double scale) {
  WeightArray weight = Filled({rows, columns}, 0.0f);
  for (size_t i = 0; i < matrix.size(); ++i)
    weight.values[i] = static_cast<float>(scale * matrix[i]);
  return weight;
}

void AddBlock(const std::string& prefix, int channels, Random& random, WeightMap& weights) {
  const int hidden = 4 * channels;
  weights[prefix + "dwconv.weight"] = DepthwiseFilters(channels, random);
  weights[prefix + "dwconv.bias"] = Filled({channels}, 0.0f);
  weights[prefix + "norm.weight"] = Filled({channels}, 1.0f);
  weights[prefix + "norm.bias"] = Filled({channels}, 0.0f);
  weights[prefix + "pwconv1.weight"] =
      Scaled(OrthogonalRows(hidden, channels, random), hidden, channels, 1.5);
  WeightArray bias = Filled({hidden}, 0.0f);
  for (float& value : bias.values) value = static_cast<float>(0.5 * random.NextNormal());
  weights[prefix + "pwconv1.bias"] = std::move(bias);
  weights[prefix + "pwconv2.weight"] =
      Scaled(OrthogonalRows(channels, hidden, random), channels, hidden, 1.0);
  weights[prefix + "pwconv2.bias"] = Filled({channels}, 0.0f);
  weights[prefix + "gamma"] = Filled({channels}, 0.7f);
}

}  // namespace

WeightMap RandomFeatureWeights(const ConvNextConfig& config, uint64_t seed) {
  WeightMap weights;
  Random random(seed, /*stream=*/0x636f6e76);
  AddStem(config, random, weights);
  for (int stage = 0; stage < config.StageCount(); ++stage) {
    if (stage > 0) AddDownsampling(stage, config, random, weights);
    for (int block = 0; block < config.depths[stage]; ++block) {
      AddBlock(fmt::format("stages.{}.{}.", stage, block), config.dims[stage], random, weights);
    }
    weights[fmt::format("norm{}.weight", stage)] = Filled({config.dims[stage]}, 1.0f);
    weights[fmt::format("norm{}.bias", stage)] = Filled({config.dims[stage]}, 0.0f);
  }
  return weights;
}

}  // namespace color3d
