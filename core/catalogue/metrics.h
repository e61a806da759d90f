// The metrics of a coloured scene, one row each: label, format and the places that show it. The
// stages evaluate and colorize_scene, the report and the client's summary read the rows. A new
// metric is the code that measures it and a row in metrics.cc; its formula is in METHOD.md
// "Metrics". Constants and pure functions.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace color3d {

// A table of the report with one row for each kind of picture and one column for each metric.
enum class MetricTable { kNone, kAgreement, kSteadiness };

struct MetricFormat {
  int decimals = 2;
  const char* unit = "";
  double scale = 1.0;  // factor from the stored to the shown value
};

struct Metric {
  // Places that show it beside scores.json. Every other place includes metrics.json.
  enum Place : unsigned {
    kInScores = 0,
    kInMetrics = 1,
    kInHeadline = 3,  // of the report
    kInSummary = 5,   // printed by the client when a job is done
    // metrics.json also has it for each way in which views are held out, with the way's suffix.
    kByHeldOut = 9,
  };
  const char* key;    // in scores.json and metrics.json
  const char* label;  // for users
  MetricFormat format = {};
  unsigned places = kInMetrics;
  MetricTable table = MetricTable::kNone;  // a column of this table
  bool Is(Place place) const { return (places & place) == place; }
};

// The same metric of other pictures: its key has a suffix.
struct MetricVariant {
  const char* suffix;
  const char* label;
  bool in_summary = true;
};

// In the order in which metrics are shown.
const std::vector<Metric>& MetricCatalogue();
const std::vector<MetricVariant>& MetricVariants();

struct FoundMetric {
  const Metric* metric = nullptr;          // nullptr if the key is unknown
  const MetricVariant* variant = nullptr;  // nullptr for the metric itself; the last one of several
};

// The row of a key, e.g. of "delta_e00_chroma_2d": "delta_e00_chroma", variant "_2d".
FoundMetric FindMetric(std::string_view key);

// Orders keys as the catalogue does, variants after their metric; unknown keys come last, by name.
std::vector<std::string> InMetricOrder(std::vector<std::string> keys);

// The keys that are columns of `table`, in order. A key without a row is one, too, so that a metric
// whose row is missing shows.
std::vector<std::string> ColumnsOf(MetricTable table, std::vector<std::string> keys);

// For unknown keys the key itself.
std::string MetricLabel(std::string_view key);
// With its unit, e.g. "27.59 dB". Values of unknown keys have six significant digits.
std::string MetricText(std::string_view key, double value);

}  // namespace color3d
