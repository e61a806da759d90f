#include "core/colorizer/training/adam.h"

#include <torch/types.h>

#include <cmath>

namespace color3d {
namespace {

constexpr double kBeta1 = 0.9;
constexpr double kBeta2 = 0.999;
constexpr double kEpsilon = 1e-8;

}  // namespace

Adam::Adam(const NamedTensors& parameters) : parameters_(parameters) {
  for (const auto& [name, tensor] : parameters_) {
    first_.push_back(torch::zeros_like(tensor));
    second_.push_back(torch::zeros_like(tensor));
  }
}

double Adam::Step(double learning_rate, double max_norm) {
  torch::NoGradGuard no_grad;
  double squares = 0.0;
  for (const auto& [name, tensor] : parameters_) {
    if (!tensor.grad().defined()) continue;
    squares += torch::sum(torch::square(tensor.grad()), torch::kFloat64).item<double>();
  }
  const double norm = std::sqrt(squares);
  if (!std::isfinite(norm)) {
    for (auto& [name, tensor] : parameters_) tensor.mutable_grad() = torch::Tensor();
    return norm;
  }
  ++steps_;
  const double clip = max_norm > 0.0 && norm > max_norm ? max_norm / norm : 1.0;
  const double correction1 = 1.0 - std::pow(kBeta1, static_cast<double>(steps_));
  const double correction2 = 1.0 - std::pow(kBeta2, static_cast<double>(steps_));
  for (size_t i = 0; i < parameters_.size(); ++i) {
    torch::Tensor& tensor = parameters_[i].second;
    if (!tensor.grad().defined()) continue;
    const torch::Tensor gradient = tensor.grad();
    first_[i].mul_(kBeta1).add_(gradient, (1.0 - kBeta1) * clip);
    second_[i].mul_(kBeta2).addcmul_(gradient, gradient, (1.0 - kBeta2) * clip * clip);
    const torch::Tensor denominator = second_[i].sqrt().div_(std::sqrt(correction2)).add_(kEpsilon);
    tensor.addcdiv_(first_[i], denominator, -learning_rate / correction1);
    tensor.mutable_grad() = torch::Tensor();
  }
  return norm;
}

NamedTensors Adam::Moments() const {
  NamedTensors moments;
  for (size_t i = 0; i < parameters_.size(); ++i) {
    moments.emplace_back("m." + parameters_[i].first, first_[i]);
    moments.emplace_back("v." + parameters_[i].first, second_[i]);
  }
  return moments;
}

}  // namespace color3d
