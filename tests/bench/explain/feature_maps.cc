#include "tests/bench/explain/feature_maps.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/image/plane_sampling.h"

namespace color3d {
namespace {

constexpr int kComponents = 3;
constexpr double kClipped = 0.02;  // share of the values at either end

double Distance(const std::vector<float>& x, const std::vector<float>& y) {
  double sum = 0.0;
  for (size_t i = 0; i < x.size(); ++i) {
    const double difference = static_cast<double>(x[i]) - y[i];
    sum += difference * difference;
  }
  return std::sqrt(sum);
}

Eigen::VectorXd PixelOf(const Image& features, size_t pixel) {
  Eigen::VectorXd value(features.channels);
  for (int c = 0; c < features.channels; ++c) value[c] = features.Plane(c)[pixel];
  return value;
}

struct Components {
  Eigen::VectorXd mean;
  Eigen::MatrixXd directions;  // a column each
};

Components FindComponents(const std::vector<const Image*>& features) {
  const int channels = features.front()->channels;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(channels);
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(channels, channels);
  double count = 0.0;
  for (const Image* map : features) {
    if (map->channels != channels) {
      throw InvalidArgument(
          "maps of {} and of {} features have no common components", channels, map->channels);
    }
    for (size_t i = 0; i < map->PlaneSize(); ++i) {
      const Eigen::VectorXd value = PixelOf(*map, i);
      sum += value;
      products.selfadjointView<Eigen::Lower>().rankUpdate(value);
      count += 1.0;
    }
  }
  Components found;
  found.mean = sum / count;
  Eigen::MatrixXd covariance = products.selfadjointView<Eigen::Lower>();
  covariance = covariance / count - found.mean * found.mean.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);  // ascending
  const int kept = std::min(kComponents, channels);
  found.directions = solver.eigenvectors().rightCols(kept).rowwise().reverse();
  for (int k = 0; k < kept; ++k) {
    Eigen::Index largest = 0;
    found.directions.col(k).cwiseAbs().maxCoeff(&largest);
    if (found.directions(largest, k) < 0.0) found.directions.col(k) *= -1.0;
  }
  return found;
}

// Stretches a component of all maps to 0..1.
void Stretch(int component, std::vector<Image>* maps) {
  std::vector<float> values;
  for (const Image& map : *maps) {
    const float* plane = map.Plane(component);
    values.insert(values.end(), plane, plane + map.PlaneSize());
  }
  std::sort(values.begin(), values.end());
  const double last = static_cast<double>(values.size() - 1);
  const float low = values[static_cast<size_t>(kClipped * last)];
  const float high = values[static_cast<size_t>((1.0 - kClipped) * last)];
  const bool varies = high - low > 1e-5f * (1.0f + std::abs(low));
  for (Image& map : *maps) {
    float* plane = map.Plane(component);
    for (size_t i = 0; i < map.PlaneSize(); ++i) {
      plane[i] = varies ? std::clamp((plane[i] - low) / (high - low), 0.0f, 1.0f) : 0.5f;
    }
  }
}

}  // namespace

std::vector<float> FeaturesAt(const FeatureMap& map, double x, double y) {
  const Image& values = map.values;
  const BilinearPlace place(values.width,
                            values.height,
                            static_cast<float>(x / map.stride_px - 0.5),
                            static_cast<float>(y / map.stride_px - 0.5));
  std::vector<float> features(values.channels);
  for (int c = 0; c < values.channels; ++c) features[c] = place.Of(values.Plane(c));
  return features;
}

void FeatureDistanceMeter::Add(const FeatureMap& from,
                               const FeatureMap& to,
                               const std::vector<PixelMatch>& matches) {
  if (matches.size() < 2) return;
  Random random(1);
  const uint32_t others = static_cast<uint32_t>(matches.size() - 1);
  for (size_t i = 0; i < matches.size(); ++i) {
    const PixelMatch& match = matches[i];
    const PixelMatch& other = matches[(i + 1 + random.NextBelow(others)) % matches.size()];
    const std::vector<float> here = FeaturesAt(from, match.x + 0.5, match.y + 0.5);
    matched_ += Distance(here, FeaturesAt(to, match.u, match.v));
    unmatched_ += Distance(here, FeaturesAt(to, other.u, other.v));
    ++places_;
  }
}

FeatureDistance FeatureDistanceMeter::Result() const {
  if (places_ == 0) return {};
  const double count = static_cast<double>(places_);
  return {places_, matched_ / count, unmatched_ / count};
}

std::vector<Image> PrincipalMaps(const std::vector<const Image*>& features) {
  if (features.empty()) return {};
  const Components components = FindComponents(features);
  std::vector<Image> maps;
  for (const Image* map : features) {
    Image picture(map->width, map->height, kComponents);
    for (size_t i = 0; i < map->PlaneSize(); ++i) {
      const Eigen::VectorXd value =
          components.directions.transpose() * (PixelOf(*map, i) - components.mean);
      for (int k = 0; k < value.size(); ++k) picture.Plane(k)[i] = static_cast<float>(value[k]);
    }
    maps.push_back(std::move(picture));
  }
  for (int k = 0; k < kComponents; ++k) Stretch(k, &maps);
  return maps;
}

}  // namespace color3d
