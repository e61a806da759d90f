#include "core/scene/sfm/pair_planner.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <map>
#include <numeric>
#include <set>
#include <utility>

namespace color3d {
namespace {

constexpr int kSequenceOverlap = 2;
constexpr int kSpanningTrees = 2;
// Fewer common features than this occur by chance.
constexpr float kClearlySimilar = 8.0f;

PhotoPair Sorted(int i, int j) { return {std::min(i, j), std::max(i, j)}; }

void AddNeighbors(const SimilarityTable& similarity, int neighbors, std::set<PhotoPair>* pairs) {
  const int count = similarity.count();
  for (int i = 0; i < count; ++i) {
    std::vector<int> others;
    for (int j = 0; j < count; ++j) {
      if (j != i) others.push_back(j);
    }
    std::ranges::sort(others, [&](int a, int b) {
      const float of_a = similarity.At(i, a), of_b = similarity.At(i, b);
      if (of_a != of_b) return of_a > of_b;
      const int near_a = std::abs(a - i), near_b = std::abs(b - i);
      return near_a != near_b ? near_a < near_b : a < b;
    });
    const bool unsure = !others.empty() && similarity.At(i, others[0]) < kClearlySimilar;
    const int take = std::min<int>(unsure ? 2 * neighbors : neighbors, others.size());
    for (int k = 0; k < take; ++k) pairs->insert(Sorted(i, others[k]));
  }
}

void AddSequence(const std::vector<int>& sequence, std::set<PhotoPair>* pairs) {
  for (int step = 1; step <= kSequenceOverlap; ++step) {
    for (size_t i = step; i < sequence.size(); ++i) {
      pairs->insert(Sorted(sequence[i - step], sequence[i]));
    }
  }
}

// Repeats Kruskal's maximum spanning tree without the pairs already taken.
void AddSpanningTrees(const SimilarityTable& similarity, std::set<PhotoPair>* pairs) {
  std::vector<PhotoPair> edges = AllPairs(similarity.count());
  std::ranges::sort(edges, [&](const PhotoPair& a, const PhotoPair& b) {
    const float of_a = similarity.At(a.first, a.second), of_b = similarity.At(b.first, b.second);
    if (of_a != of_b) return of_a > of_b;
    const int apart_a = a.second - a.first, apart_b = b.second - b.first;
    return apart_a != apart_b ? apart_a < apart_b : a < b;
  });
  std::set<PhotoPair> taken;
  for (int tree = 0; tree < kSpanningTrees; ++tree) {
    std::vector<int> parent(similarity.count());
    std::iota(parent.begin(), parent.end(), 0);
    const auto root = [&](int i) {
      while (parent[i] != i) i = parent[i] = parent[parent[i]];
      return i;
    };
    for (const PhotoPair& edge : edges) {
      const int a = root(edge.first), b = root(edge.second);
      if (a == b || taken.count(edge) > 0) continue;
      parent[a] = b;
      taken.insert(edge);
    }
  }
  pairs->insert(taken.begin(), taken.end());
}

// Begin and end of the last number in a name.
std::pair<size_t, size_t> LastNumber(const std::string& name) {
  const auto digit = [&](size_t i) { return std::isdigit(static_cast<unsigned char>(name[i])); };
  size_t end = name.size();
  while (end > 0 && !digit(end - 1)) --end;
  size_t begin = end;
  while (begin > 0 && digit(begin - 1)) --begin;
  return {begin, end};
}

}  // namespace

std::optional<std::vector<int>> SequenceOrder(const std::vector<std::string>& names) {
  constexpr size_t kMaxDigits = 18;  // fits in 64 bits
  std::vector<std::pair<int64_t, int>> numbered;
  std::string frame;
  for (size_t i = 0; i < names.size(); ++i) {
    const auto [begin, end] = LastNumber(names[i]);
    if (begin == end || end - begin > kMaxDigits) return std::nullopt;
    const std::string rest = names[i].substr(0, begin) + "#" + names[i].substr(end);
    if (i > 0 && rest != frame) return std::nullopt;
    frame = rest;
    numbered.emplace_back(std::stoll(names[i].substr(begin, end - begin)), static_cast<int>(i));
  }
  std::ranges::sort(numbered);
  std::vector<int> order;
  for (size_t i = 0; i < numbered.size(); ++i) {
    if (i > 0 && numbered[i].first == numbered[i - 1].first) return std::nullopt;
    order.push_back(numbered[i].second);
  }
  return order;
}

std::vector<PhotoPair> AllPairs(int count) {
  std::vector<PhotoPair> pairs;
  for (int i = 0; i < count; ++i) {
    for (int j = i + 1; j < count; ++j) pairs.emplace_back(i, j);
  }
  return pairs;
}

namespace {

// Indices by camera, each ascending.
std::vector<std::vector<int>> FramesByCamera(const std::vector<int>& camera) {
  std::map<int, std::vector<int>> frames;
  for (size_t i = 0; i < camera.size(); ++i) frames[camera[i]].push_back(static_cast<int>(i));
  std::vector<std::vector<int>> all;
  for (auto& [name, own] : frames) all.push_back(std::move(own));
  return all;
}

// Photos that another photo overlaps; a few matches of unrelated photos occur by chance.
int CountRelated(const SimilarityTable& similarity) {
  constexpr float kRelated = 10.0f;
  int related = 0;
  for (int i = 0; i < similarity.count(); ++i) {
    float best = 0.0f;
    for (int j = 0; j < similarity.count(); ++j) best = std::max(best, similarity.At(i, j));
    related += best >= kRelated ? 1 : 0;
  }
  return related;
}

}  // namespace

PairPlan PairsInSequence(const std::vector<int>& camera) {
  PairPlan plan;
  for (const std::vector<int>& frames : FramesByCamera(camera)) {
    for (size_t i = 0; i < frames.size(); ++i) {
      for (size_t step = 1; step <= 16 && i + step < frames.size(); step *= 2) {
        plan.pairs.push_back(Sorted(frames[i], frames[i + step]));
      }
    }
  }
  std::ranges::sort(plan.pairs);
  plan.reason = fmt::format("{} pairs of frames up to 16 apart", plan.pairs.size());
  plan.related = static_cast<int>(camera.size());
  return plan;
}

std::vector<int> FramesToCompare(const std::vector<int>& camera) {
  constexpr size_t kMostCompared = 120;
  const std::vector<std::vector<int>> cameras = FramesByCamera(camera);
  if (cameras.size() < 2) return {};
  const size_t share = std::max<size_t>(1, kMostCompared / cameras.size());
  std::vector<int> compared;
  for (const std::vector<int>& frames : cameras) {
    const size_t count = std::min(share, frames.size());
    for (size_t i = 0; i < count; ++i) {
      compared.push_back(frames[(2 * i + 1) * frames.size() / (2 * count)]);
    }
  }
  std::ranges::sort(compared);
  return compared;
}

void AddPairsAcross(const std::vector<int>& camera,
                    const std::vector<int>& compared,
                    const SimilarityTable& similarity,
                    PairPlan* plan) {
  constexpr size_t kMostSimilar = 4, kPairsOfCameras = 8;
  // Similarity and index: for each frame and other camera, and for each pair of cameras.
  using Candidates = std::vector<std::pair<float, PhotoPair>>;
  std::map<std::pair<int, int>, Candidates> of_frame, of_cameras;
  for (int i = 0; i < similarity.count(); ++i) {
    for (int j = i + 1; j < similarity.count(); ++j) {
      const int a = compared[i], b = compared[j];
      if (camera[a] == camera[b]) continue;
      const std::pair<float, PhotoPair> candidate{-similarity.At(i, j), {a, b}};
      of_frame[{a, camera[b]}].push_back(candidate);
      of_frame[{b, camera[a]}].push_back(candidate);
      of_cameras[std::minmax(camera[a], camera[b])].push_back(candidate);
    }
  }
  std::set<PhotoPair> across;
  const auto take = [&](Candidates candidates, size_t most, float least) {
    std::ranges::sort(candidates);
    candidates.resize(std::min(most, candidates.size()));
    for (const auto& [unlike, pair] : candidates) {
      if (-unlike >= least) across.insert(pair);
    }
  };
  for (const auto& [frame, candidates] : of_frame) take(candidates, kMostSimilar, kClearlySimilar);
  for (const auto& [cameras, candidates] : of_cameras) take(candidates, kPairsOfCameras, 0.0f);
  plan->pairs.insert(plan->pairs.end(), across.begin(), across.end());
  std::ranges::sort(plan->pairs);
  plan->reason += fmt::format(", {} across cameras", across.size());
}

PairPlan PlanPairs(const SimilarityTable& similarity,
                   const std::vector<int>& sequence,
                   int neighbors) {
  std::set<PhotoPair> pairs;
  AddNeighbors(similarity, neighbors, &pairs);
  AddSequence(sequence, &pairs);
  AddSpanningTrees(similarity, &pairs);
  const size_t count = similarity.count();
  const size_t all = count * (count - 1) / 2;
  constexpr double kMaxShareOfPairs = 0.7;
  if (static_cast<double>(pairs.size()) >= kMaxShareOfPairs * static_cast<double>(all)) {
    return {AllPairs(similarity.count()),
            fmt::format("all {} pairs: few photos", all),
            CountRelated(similarity)};
  }
  return {{pairs.begin(), pairs.end()},
          fmt::format("{} of {} pairs: the {} most similar photos of each, {}two spanning trees",
                      pairs.size(),
                      all,
                      neighbors,
                      sequence.empty() ? "" : "neighbours in the sequence of names, "),
          CountRelated(similarity)};
}

std::vector<PhotoPair> UnregisteredPairs(const std::vector<bool>& placed,
                                         const std::vector<PhotoPair>& tried) {
  const std::set<PhotoPair> known(tried.begin(), tried.end());
  std::vector<PhotoPair> pairs;
  for (const PhotoPair& pair : AllPairs(static_cast<int>(placed.size()))) {
    if (placed[pair.first] && placed[pair.second]) continue;
    if (known.count(pair) == 0) pairs.push_back(pair);
  }
  return pairs;
}

}  // namespace color3d
