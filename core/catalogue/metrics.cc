#include "core/catalogue/metrics.h"

#include <fmt/core.h>

#include <algorithm>
#include <tuple>
#include <utility>

namespace color3d {
namespace {

constexpr MetricTable kAgreement = MetricTable::kAgreement;
constexpr MetricTable kSteadiness = MetricTable::kSteadiness;
constexpr double kPercent = 100.0;

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
  static const std::vector<Metric> catalogue = {
      // Of held-out views: core/metrics/view_scores.h.
      {.key = "delta_e00_chroma",
       .label = "colour error (CIEDE2000)",
       .in_headline = true,
       .in_summary = true,
       .by_held_out = true},
      {.key = "delta_e00_gray",
       .label = "colour error if left grey",
       .in_headline = true,
       .in_summary = true},
      {.key = "delta_e00", .label = "CIEDE2000, luminance included"},
      {.key = "psnr_rgb",
       .label = "PSNR of held-out views",
       .unit = " dB",
       .in_headline = true,
       .in_summary = true,
       .by_held_out = true},
      {.key = "ssim_rgb", .label = "SSIM", .decimals = 4, .in_summary = true},
      {.key = "psnr_l",
       .label = "PSNR of luminance",
       .unit = " dB",
       .in_summary = true,
       .by_held_out = true},
      {.key = "ab_rmse", .label = "RMSE of a and b"},
      {.key = "colorfulness", .label = "colourfulness", .decimals = 1},
      {.key = "colorfulness_ratio", .label = "colourfulness, relative to the truth"},
      // Of held-out pixels by the source of their colour.
      {.key = "delta_e00_seen", .label = "colour error where seen"},
      {.key = "delta_e00_inferred", .label = "colour error where inferred"},
      {.key = "delta_e00_guessed", .label = "colour error where guessed"},
      {.key = "confidence_rank_correlation", .label = "rank correlation of confidence and error"},
      // Agreement of views: core/metrics/consistency.h.
      {.key = "me", .label = "ME", .decimals = 4, .table = kAgreement},
      {.key = "me_de00", .label = "ME, CIEDE2000", .table = kAgreement},
      {.key = "tc", .label = "TC", .decimals = 5, .table = kAgreement},
      {.key = "tc_short",
       .label = "TC, next view",
       .decimals = 5,
       .in_metrics = false,
       .table = kAgreement},
      {.key = "tc_long",
       .label = "TC, 7 apart",
       .decimals = 5,
       .in_metrics = false,
       .table = kAgreement},
      {.key = "matches", .label = "matched pixels", .decimals = 0, .in_metrics = false},
      {.key = "pairs", .label = "pairs of pictures", .decimals = 0, .in_metrics = false},
      // Steadiness of films: core/metrics/temporal_consistency.h.
      {.key = "tc_chroma", .label = "TC of chroma", .in_summary = true, .table = kSteadiness},
      {.key = "chroma",
       .label = "mean chroma",
       .decimals = 1,
       .in_metrics = false,
       .table = kSteadiness},
      {.key = "followed",
       .label = "followed",
       .decimals = 0,
       .unit = " %",
       .scale = kPercent,
       .in_metrics = false,
       .table = kSteadiness},
      {.key = "cdc", .label = "CDC", .decimals = 5, .in_summary = true, .table = kSteadiness},
      {.key = "cdc_1", .label = "CDC, 1 apart", .decimals = 5, .in_metrics = false},
      {.key = "cdc_2", .label = "CDC, 2 apart", .decimals = 5, .in_metrics = false},
      {.key = "cdc_4", .label = "CDC, 4 apart", .decimals = 5, .in_metrics = false},
      // Sources of the colour.
      {.key = "coverage",
       .label = "covered by key views",
       .decimals = 0,
       .unit = " %",
       .scale = kPercent},
      {.key = "share_seen",
       .label = "seen in a key view",
       .decimals = 0,
       .unit = " %",
       .scale = kPercent,
       .in_headline = true,
       .in_summary = true},
      {.key = "share_inferred",
       .label = "inferred",
       .decimals = 0,
       .unit = " %",
       .scale = kPercent},
      {.key = "share_guessed",
       .label = "guessed",
       .decimals = 0,
       .unit = " %",
       .scale = kPercent,
       .in_headline = true},
      // The work.
      {.key = "gaussians",
       .label = "Gaussians",
       .decimals = 0,
       .in_headline = true,
       .in_summary = true},
      {.key = "seconds_total",
       .label = "computing time",
       .decimals = 0,
       .unit = " s",
       .in_headline = true},
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
  return fmt::format("{:.{}f}{}", metric->scale * value, metric->decimals, metric->unit);
}

}  // namespace color3d
