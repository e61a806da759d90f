// Colours by the vote of similar cells near in space, compared with the definition in float64; and
// whitening of features if views do not differ, or differ in one channel only.
#include <torch/types.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include "core/matching/cell_matches.h"
#include "core/matching/whitening.h"
#include "tests/stability/stability_case.h"

namespace color3d {
namespace {

constexpr int64_t kEntries = 400, kQueries = 60, kFeatures = 16;

struct Problem {
  CellBank bank{torch::rand({kEntries, kFeatures}),
                torch::rand({kEntries, 2}) * 160.0 - 80.0,
                torch::ones({kEntries}),
                Known(torch::rand({kEntries, 3}))};
  CellQueries queries{torch::rand({kQueries, kFeatures}), Known(torch::rand({kQueries, 3}))};
  VoteOptions options{.position_weight = 1.5};
  double condition = 1.0;  // ratio of the largest to the smallest relevant squared distance

  static torch::Tensor Known(const torch::Tensor& places) {
    return torch::cat({places, torch::ones({places.size(0), 1})}, 1);
  }
};

torch::Tensor Exact(const torch::Tensor& x) { return x.to(torch::kFloat64); }

torch::Tensor SquaredDistance64(const torch::Tensor& x, const torch::Tensor& y) {
  return (Exact(x).unsqueeze(1) - Exact(y).unsqueeze(0)).square().sum(2);
}

torch::Tensor Vote64(const Problem& p) {
  const torch::Tensor s =
      SquaredDistance64(p.queries.positions.slice(1, 0, 3), p.bank.positions.slice(1, 0, 3)) *
      Exact(p.queries.positions.slice(1, 3, 4));
  const torch::Tensor d = SquaredDistance64(p.queries.features, p.bank.features) +
                          p.options.position_weight * s / (1.0 + s / p.options.position_reach);
  const torch::Tensor best = std::get<0>(d.min(1, /*keepdim=*/true));
  const torch::Tensor exponent =
      (best - d) / (p.options.temperature * (best + p.options.distance_floor));
  const torch::Tensor weight = exponent.exp() * (exponent >= -8.0);
  return torch::mm(weight, Exact(p.bank.colors)) / weight.sum(1, /*keepdim=*/true);
}

StabilityResult RunVote(const Problem& p, double bound) {
  StabilityResult r;
  r.condition = p.condition;
  r.condition_of = "squared distances";
  const CellMatches found = MatchCells(p.queries, p.bank, p.options);
  const torch::Tensor ab = found.ab.contiguous();
  r.non_finite = CountNonFinite(ab.data_ptr<float>(), static_cast<size_t>(ab.numel()));
  const torch::Tensor expected = Vote64(p);
  r.value_error = ((Exact(ab) - expected).abs().max() / expected.abs().max()).item<double>();
  r.value_bound = bound;
  r.compared = ab.numel();
  return r;
}

StabilityResult RunWhitening(const torch::Tensor& samples,
                             const torch::Tensor& noise,
                             double condition) {
  StabilityResult r;
  r.condition = condition;
  r.condition_of = "noise of views";
  const std::vector<torch::Tensor> blocks{samples, torch::randn({samples.size(0), 2})};
  const Whitening whitening(blocks, 4, {}, {noise, torch::eye(2, torch::kFloat64)});
  const torch::Tensor found = whitening.Apply(blocks).contiguous();
  r.non_finite = CountNonFinite(found.data_ptr<float>(), static_cast<size_t>(found.numel()));
  // Each block of features has its share of the distance at any noise.
  const torch::Tensor variance = found.var(0, /*unbiased=*/false);
  const int64_t kept = std::min<int64_t>(WhiteningOptions().dims_per_block, samples.size(1));
  const double share = WhiteningOptions().tap_shares[1];
  r.value_error = std::abs(variance.slice(0, 0, kept).sum().item<double>() - share) / share;
  r.value_bound = 1e-3;
  r.compared = found.numel();
  return r;
}

}  // namespace

void AddMatchingCases(std::vector<StabilityCase>& cases) {
  const auto vote = [&](const std::string& name, double bound, auto change) {
    cases.push_back({"matching", name, false, [bound, change](ThreadPool&) {
                       torch::manual_seed(11);
                       Problem p;
                       change(&p);
                       return RunVote(p, bound);
                     }});
  };
  vote("places everywhere", 1e-4, [](Problem*) {});
  vote("all in one place", 1e-4, [](Problem* p) {
    p->bank.positions.slice(1, 0, 3).fill_(2.9);
    p->queries.positions.slice(1, 0, 3).fill_(2.9);
  });
  // Far from the scene's middle, a thousandth of its radius apart.
  vote("places close together, far out", 1e-4, [](Problem* p) {
    for (torch::Tensor* places : {&p->bank.positions, &p->queries.positions}) {
      torch::Tensor xyz = places->slice(1, 0, 3);
      xyz.mul_(1e-3).add_(1.7);
    }
    p->condition = 1e6;
  });
  vote("places a million radii away", 1e-4, [](Problem* p) {
    p->bank.positions.slice(1, 0, 3).mul_(1e6);
    p->condition = 1e12;
  });
  vote("space counts a million times", 5e-3, [](Problem* p) {
    p->options.position_weight = 1e6;
    p->condition = 1e6;
  });
  vote("features a thousand times as large", 1e-4, [](Problem* p) {
    p->bank.features.mul_(1e3);
    p->queries.features.mul_(1e3);
    p->condition = 1e6;
  });

  vote("temperature 1e-4", 1e-3, [](Problem* p) {
    p->options.temperature = 1e-4;
    p->condition = 1e4;
  });
  vote("temperature 1e4", 1e-4, [](Problem* p) { p->options.temperature = 1e4; });
  vote("equal scores", 1e-4, [](Problem* p) {
    p->bank.features.fill_(0.5);
    p->queries.features.fill_(0.5);
    p->options.position_weight = 0.0;
  });
  vote("scores of 1e30", 1e-4, [](Problem* p) {
    p->bank.features.mul_(1e15);
    p->queries.features.mul_(1e15);
    p->condition = 1e30;
  });

  const auto whitening = [&](const std::string& name, double condition, auto noise) {
    cases.push_back({"matching", name, false, [condition, noise](ThreadPool&) {
                       torch::manual_seed(12);
                       return RunWhitening(torch::randn({500, 24}), noise(), condition);
                     }});
  };
  whitening("views that do not differ", 1.0, [] {
    return torch::zeros({24, 24}, torch::kFloat64);
  });
  whitening("views that differ by one channel", HUGE_VAL, [] {
    torch::Tensor noise = torch::zeros({24, 24}, torch::kFloat64);
    noise[3][3] = 1.0;
    return noise;
  });
  whitening("noise of 10^12:1", 1e12, [] {
    return torch::diag(torch::logspace(-12, 0, 24, 10.0, torch::kFloat64));
  });
}

}  // namespace color3d
