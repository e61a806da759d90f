#include "core/catalogue/metrics.h"

#include <fmt/core.h>

#include <algorithm>
#include <tuple>
#include <utility>

namespace color3d {
namespace {

constexpr MetricTable kAgreement = MetricTable::kAgreement;
constexpr MetricTable kSteadiness = MetricTable::kSteadiness;
constexpr MetricFormat kDecibels = {2, " dB"};
constexpr MetricFormat kPercent = {0, " %", 100.0};
constexpr MetricFormat kSeconds = {0, " s"};

// Position in the catalogue, then position of the variant.
std::tuple<size_t, size_t, std::string> Rank(const std::string& key) {
  const FoundMetric found = FindMetric(key);
  if (found.metric == nullptr) return {MetricCatalogue().size(), 0, key};
  return {found.metric - MetricCatalogue().data(),
          found.variant != nullptr ? found.variant - MetricVariants().data() + 1 : 0,
          key};
}

}  // namespace

const std::vector<Metric>& MetricCatalogue() {
  using enum Metric::Place;
  static const std::vector<Metric> catalogue = {
      // Held-out views: core/metrics/view_scores.h.
      {"delta_e00_chroma", "colour error (CIEDE2000)", {}, kInHeadline | kInSummary | kByHeldOut},
      {"delta_e00_gray", "colour error if left grey", {}, kInHeadline | kInSummary},
      {"delta_e00_chroma_p90", "colour error, 90th percentile of pixels"},
      {"delta_e00", "CIEDE2000, luminance included"},
      {"psnr_rgb", "PSNR of held-out views", kDecibels, kInHeadline | kInSummary | kByHeldOut},
      {"ssim_rgb", "SSIM", {4}, kInSummary},
      {"psnr_l", "PSNR of luminance", kDecibels, kInSummary | kByHeldOut},
      {"ab_rmse", "RMSE of a and b"},
      {"colorfulness", "colourfulness", {1}},
      {"colorfulness_ratio", "colourfulness, relative to the truth"},
      {"colorfulness_absolute", "colourfulness, absolute channels", {1}},
      // Held-out pixels by the source of their colour.
      {"delta_e00_seen", "colour error where seen"},
      {"delta_e00_inferred", "colour error where inferred"},
      {"delta_e00_guessed", "colour error where guessed"},
      {"confidence_rank_correlation", "rank correlation of confidence and error"},
      // Agreement of views: core/metrics/consistency.h.
      {"me", "ME", {4}, kInMetrics, kAgreement},
      {"me_de00", "ME, CIEDE2000", {}, kInMetrics, kAgreement},
      {"tc", "TC", {5}, kInMetrics, kAgreement},
      {"tc_short", "TC, next view", {5}, kInScores, kAgreement},
      {"tc_long", "TC, 7 apart", {5}, kInScores, kAgreement},
      {"matches", "matched pixels", {0}, kInScores},
      // The same on matches that all methods share: core/metrics/flow_matches.h.
      {"me_common", "ME, common matches", {4}, kInMetrics, kAgreement},
      {"me_de00_common", "ME, CIEDE2000, common matches", {}, kInMetrics, kAgreement},
      {"tc_common", "TC, common matches", {5}, kInMetrics, kAgreement},
      {"tc_short_common", "TC, next view, common matches", {5}, kInScores},
      {"tc_long_common", "TC, 7 apart, common matches", {5}, kInScores},
      {"matches_common", "common matched pixels", {0}, kInScores},
      {"pairs", "pairs of pictures", {0}, kInScores},
      // Steadiness of films: core/metrics/temporal_consistency.h.
      {"tc_chroma", "TC of chroma", {}, kInSummary, kSteadiness},
      {"chroma", "mean chroma", {1}, kInScores, kSteadiness},
      {"followed", "followed", kPercent, kInScores, kSteadiness},
      {"cdc", "CDC", {5}, kInSummary, kSteadiness},
      {"cdc_1", "CDC, 1 apart", {5}, kInScores},
      {"cdc_2", "CDC, 2 apart", {5}, kInScores},
      {"cdc_4", "CDC, 4 apart", {5}, kInScores},
      // Sources of the colour.
      {"coverage", "covered by key views", kPercent},
      {"share_seen", "seen in a key view", kPercent, kInHeadline | kInSummary},
      {"share_inferred", "inferred", kPercent},
      {"share_guessed", "guessed", kPercent, kInHeadline},
      // The work.
      {"gaussians", "Gaussians", {0}, kInHeadline | kInSummary},
      {"seconds_total", "computing time", kSeconds, kInHeadline},
      {"seconds_per_frame", "computing time of a frame", {2, " s"}},
  };
  return catalogue;
}

const std::vector<MetricVariant>& MetricVariants() {
  static const std::vector<MetricVariant> variants = {
      {"_2d", "photos in colour", false},
      {"_bound", "under all true colours"},
      {"_truth", "true colours"},
      {"_camera", "held-out cameras"},
      {"_moment", "held-out times"},
      {"_block", "held-out blocks of time"},
      {"_scored", "scored views", false},
  };
  return variants;
}

FoundMetric FindMetric(std::string_view key) {
  for (const Metric& metric : MetricCatalogue()) {
    if (key == metric.key) return {&metric, nullptr};
  }
  for (const MetricVariant& variant : MetricVariants()) {
    if (!key.ends_with(variant.suffix)) continue;
    key.remove_suffix(std::string_view(variant.suffix).size());
    return {FindMetric(key).metric, &variant};
  }
  return {};
}

std::vector<std::string> InMetricOrder(std::vector<std::string> keys) {
  std::ranges::sort(keys, {}, Rank);
  return keys;
}

std::vector<std::string> ColumnsOf(MetricTable table, std::vector<std::string> keys) {
  std::erase_if(keys, [&](const std::string& key) {
    const Metric* metric = FindMetric(key).metric;
    return metric != nullptr && metric->table != table;
  });
  return InMetricOrder(std::move(keys));
}

std::string MetricLabel(std::string_view key) {
  const FoundMetric found = FindMetric(key);
  if (found.metric == nullptr) return std::string(key);
  if (found.variant == nullptr) return found.metric->label;
  return fmt::format("{}, {}", found.metric->label, found.variant->label);
}

std::string MetricText(std::string_view key, double value) {
  const Metric* metric = FindMetric(key).metric;
  if (metric == nullptr) return fmt::format("{:.6g}", value);
  const auto& [decimals, unit, scale] = metric->format;
  return fmt::format("{:.{}f}{}", scale * value, decimals, unit);
}

}  // namespace color3d
